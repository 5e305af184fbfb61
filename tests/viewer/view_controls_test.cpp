#include <GLFW/glfw3.h>
#include <gtest/gtest.h>

#include "browse/view_window.hpp"
#include "window_pictures.hpp"

namespace gelslam::viewer::detail {
namespace {

/// Keyframes at 10, 12, 14 s, poses from 10 to 50 s.
RunHistory history() {
  RunHistory result;
  for (int k = 0; k < 3; ++k) result.keyframes_s.push_back(10.0 + 2 * k);
  for (int i = 0; i <= 40; ++i) result.trajectory.push_back({10.0 + i, Pose::Identity()});
  return result;
}

TEST(ViewControls, ArrowsGoKeyframeByKeyframeAndTheEndIsTheSavedRun) {
  const RunHistory run = history();
  ViewControls controls(&run, false, {}, std::nullopt);
  const auto after = [&](int key) {
    controls.press_key(key, 0);
    return controls.time_s().value_or(-1);
  };
  EXPECT_EQ(after(GLFW_KEY_LEFT), 14);
  EXPECT_EQ(after(GLFW_KEY_LEFT), 12);
  EXPECT_EQ(after(GLFW_KEY_LEFT), 10);
  EXPECT_EQ(after(GLFW_KEY_LEFT), 10);
  EXPECT_EQ(after(GLFW_KEY_RIGHT), 12);
  EXPECT_EQ(after(GLFW_KEY_RIGHT), 14);
  EXPECT_EQ(after(GLFW_KEY_RIGHT), -1);
}

TEST(ViewControls, PlayingEndsAtTheSavedRunWithinTwentySeconds) {
  const RunHistory run = history();
  ViewControls controls(&run, false, {}, std::nullopt);
  EXPECT_FALSE(controls.advance(1));
  controls.press_key(GLFW_KEY_SPACE, 0);
  EXPECT_DOUBLE_EQ(*controls.time_s(), 10) << "from the start";
  double played_s = 0;
  while (controls.advance(0.02) && controls.plays()) played_s += 0.02;
  EXPECT_NEAR(played_s, 20, 0.1);
  EXPECT_FALSE(controls.time_s());
  controls.press_key(GLFW_KEY_SPACE, 0);
  controls.advance(1);
  controls.press_key(GLFW_KEY_SPACE, 0);
  const auto rests_at = controls.time_s();
  EXPECT_FALSE(controls.advance(1));
  EXPECT_EQ(controls.time_s(), rests_at);
}

TEST(ViewControls, NoKeyMeansTwoThings) {
  const RunHistory run = history();
  test::expect_keys_of_one_meaning(ViewControls(&run, true, {}, {}).rows());
}

}  // namespace
}  // namespace gelslam::viewer::detail
