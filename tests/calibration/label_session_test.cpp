// What a person decides about circles, without a window.

#include "gelslam/calibration/label_session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/temporary_folder.hpp"
#include "gelslam/calibration/ball_zones.hpp"
#include "simulated_presses.hpp"

namespace gelslam::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// Five presses of a gray gel: p0 to p4. What was found in them is made up: p3 has no clear contact.
class Labelling : public ::testing::Test {
 protected:
  void SetUp() override {
    set.background = cv::Mat3b(60, 80, cv::Vec3b(90, 100, 110));
    set.background.rowRange(30, 60) += cv::Scalar(10, 10, 10);  // one color all over is no picture
    for (int k = 0; k < 5; ++k) {
      set.presses.push_back({"p" + std::to_string(k), 6.0, set.background, std::nullopt});
      found.push_back({{20.0 + k, 30.0, 10.0}, 0.95, ""});
    }
    found[3] = {{}, 0.0, "nothing touches the gel"};
    set.folder = folder / "set";
    write_folder(set.folder, set);
  }
  LabelSession session() const { return {read_press_set(set.folder), found}; }
  fs::path label_of(const std::string& press) const { return set.folder / press / "label.npz"; }
  fs::path left_out_of(const std::string& press) const { return set.folder / press / "left_out.npz"; }

  TemporaryFolder folder;
  PressSet set;
  std::vector<FoundCircle> found;
};

std::string shown(const LabelSession& session) { return session.press().name; }

TEST_F(Labelling, BeginsWithTheDoubtfulOnes) {
  LabelSession labels = session();
  EXPECT_EQ(shown(labels), "p3");
  EXPECT_EQ(labels.label().warning, "nothing touches the gel");
  EXPECT_EQ(labels.label().circle.u_px, 40.0) << "somewhere to begin: the middle";
  EXPECT_EQ(labels.progress(), "0 of 5 accepted, 1 doubtful");
  labels.show(1);
  EXPECT_EQ(shown(labels), "p0");
  EXPECT_EQ(labels.label().warning, "");
}

TEST_F(Labelling, AcceptsOneAfterTheOtherAndComesBackToWhatIsOpen) {
  LabelSession labels = session();
  labels.show(2);  // p1
  for (const char* next : {"p2", "p4", "p3", "p0"}) {
    labels.accept();
    EXPECT_EQ(shown(labels), next);
  }
  EXPECT_FALSE(labels.accept()) << "none is open";
  EXPECT_EQ(labels.counts().accepted, 5U);
  EXPECT_EQ(labels.counts().doubtful, 0U) << "who accepts a doubtful one has decided";
}

TEST_F(Labelling, ALabelThatCannotBeReadIsNotReplacedUnseen) {
  write_bytes(label_of("p2"), "damaged");
  LabelSession labels = session();
  EXPECT_EQ(labels.accept_rest(), 2U) << "p3 shows nothing";
  labels.save();
  EXPECT_EQ(read_bytes(label_of("p2")), "damaged");
  ASSERT_EQ(shown(labels), "p2");
  EXPECT_THAT(labels.label().warning, HasSubstr("p2/label.npz"));
  labels.accept();  // a person has seen it
  labels.save();
  EXPECT_EQ(read_label(label_of("p2")).u_px, 22.0);
}

TEST_F(Labelling, WritesWhatWasDecidedAndNothingElse) {
  LabelSession labels = session();
  EXPECT_EQ(labels.unsaved(), 0U);
  labels.show(1);
  labels.put({21.25, 30.0, 10.0});
  EXPECT_EQ(labels.unsaved(), 0U) << "not accepted yet";
  labels.accept();     // p0
  labels.leave_out();  // p1
  EXPECT_EQ(labels.unsaved(), 2U);
  labels.save();
  EXPECT_EQ(labels.unsaved(), 0U);
  EXPECT_EQ(read_label(label_of("p0")).u_px, 21.25);
  EXPECT_FALSE(fs::exists(label_of("p1")));
  EXPECT_TRUE(fs::exists(left_out_of("p1")));
  EXPECT_FALSE(fs::exists(label_of("p2")) || fs::exists(label_of("p3")) || fs::exists(label_of("p4")));
}

TEST_F(Labelling, GoesOnWhereItWasLeft) {
  write_label(label_of("p2"), {22.5, 31.0, 11.0});  // a person's, from elsewhere
  write_label(left_out_of("p4"), {24.0, 30.0, 10.0});
  LabelSession labels = session();
  EXPECT_EQ(labels.progress(), "1 of 5 accepted, 1 doubtful, 1 left out");
  labels.show(3);
  ASSERT_EQ(shown(labels), "p2");
  EXPECT_EQ(labels.label().origin, LabelOrigin::from_file);
  EXPECT_EQ(labels.label().circle.u_px, 22.5);
  labels.put({23.0, 31.0, 11.0});  // corrected: stays accepted
  labels.show(4);
  labels.accept();  // p4 after all
  EXPECT_EQ(labels.unsaved(), 2U);
  labels.save();
  EXPECT_EQ(read_label(label_of("p2")).u_px, 23.0);
  EXPECT_TRUE(fs::exists(label_of("p4")));
  EXPECT_FALSE(fs::exists(left_out_of("p4")));
}

TEST_F(Labelling, LeftOutPressesAreNotTrainedOn) {
  write_label(left_out_of("p0"), {20.0, 30.0, 10.0});
  const PressSet read = read_press_set(set.folder);
  ASSERT_TRUE(read.presses[0].left_out);
  const BallZones zones = find_ball_zones(read, 0.0634, true);
  ASSERT_FALSE(zones.rejected.empty());
  EXPECT_EQ(zones.rejected.front().press, 0U);
  EXPECT_THAT(zones.rejected.front().reason, HasSubstr("a person has left it out"));
}

// Contacts of one ball, and what is to be used of them: what `calibrate collect` counts.
TEST_F(Labelling, CollectedPressesComeLastAndAreCounted) {
  LabelSession labels({set.folder, {}, {}}, {});
  EXPECT_EQ(labels.progress(), "0 of 0 accepted");
  labels.add({"p0", 6.0, set.background, std::nullopt}, found[0], set.background);
  labels.add({"p1", 9.5, set.background, std::nullopt}, found[1], set.background);
  labels.add({"p2", 6.0, set.background, std::nullopt}, found[2], set.background);
  EXPECT_EQ(labels.progress(), "3 of 3 accepted");
  EXPECT_EQ(labels.unsaved(), 0U) << "they have their labels";
  EXPECT_EQ(labels.contacts(6.0).size(), 2U);
  labels.show(2);
  labels.leave_out();
  ASSERT_EQ(labels.contacts(6.0).size(), 1U);
  EXPECT_EQ(labels.contacts(6.0).front().u_px, 20.0);
  labels.save();
  EXPECT_TRUE(fs::exists(left_out_of("p2")));
  const LabelSession open = session();
  EXPECT_EQ(open.contacts(6.0).size(), 3U) << "not decided yet; p2 is left out, p3 has no clear contact";
}

}  // namespace
}  // namespace gelslam::test
