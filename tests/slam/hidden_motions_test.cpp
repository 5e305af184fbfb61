#include <gtest/gtest.h>

#include "gelslam/slam/trial_drift.hpp"

namespace gelslam {
namespace {

constexpr std::array<bool, 6> kAll = {true, true, true, true, true, true};
constexpr std::array<bool, 6> kNoTwist = {true, true, true, true, true, false};

class HiddenMotionsTest : public testing::Test {
 protected:
  void pass(const std::array<bool, 6>& observable, int frames, int trial = 0) {
    for (int k = 0; k < frames; ++k) motions.pass(trial, observable);
  }

  HiddenMotions motions;
};

TEST_F(HiddenMotionsTest, AreSaidOnceTheyHaveLastedAndTakenBackLikewise) {
  EXPECT_EQ(motions.words(), "");
  pass(kAll, 10);
  pass(kNoTwist, 12);
  EXPECT_EQ(motions.words(), "");
  pass(kNoTwist, 2);
  EXPECT_EQ(motions.words(), "twisting is not observable");
  pass(kAll, 12);
  EXPECT_EQ(motions.words(), "twisting is not observable");
  pass(kAll, 2);
  EXPECT_EQ(motions.words(), "");
}

TEST_F(HiddenMotionsTest, SingleFramesChangeNothing) {
  for (int k = 0; k < 100; ++k) {
    pass(kNoTwist, 5);
    pass(kAll, 1);
    ASSERT_EQ(motions.words(), "");
  }
}

TEST_F(HiddenMotionsTest, ANewTrialBeginsAnew) {
  pass(kNoTwist, 20);
  EXPECT_NE(motions.words(), "");
  pass(kNoTwist, 1, 1);
  EXPECT_EQ(motions.words(), "");
  pass(kNoTwist, 14, 1);
  EXPECT_NE(motions.words(), "");
}

}  // namespace
}  // namespace gelslam
