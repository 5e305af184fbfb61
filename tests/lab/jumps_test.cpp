#include <gtest/gtest.h>

#include "gelslam/frontend/tracker.hpp"
#include "judgement.hpp"
#include "simulated_frames.hpp"
#include "touch_studio.hpp"

namespace gelslam::lab {
namespace {

struct Jump {
  const char* object;
  int place;
  double slide_mm, twist_deg;
};

TouchPair make(const Jump& jump) {
  static TouchStudio studio(simulated_frames().model);
  TouchSpec spec;
  spec.object = jump.object;
  spec.place = jump.place;
  spec.overlap = 1;
  spec.moved = Pose(Eigen::AngleAxisd(jump.twist_deg * M_PI / 180, Eigen::Vector3d::UnitZ()));
  spec.moved.translation() = jump.slide_mm * Eigen::Vector3d(0.92, 0.39, 0);
  return studio.make(spec);
}

/// The object jumps between the first two pictures of a trial.
Judgement follow(const TouchPair& pair, bool relocalize) {
  TrackerOptions options;
  options.relocalize = relocalize;
  Tracker tracker(options);
  tracker.track(0, 0, pair.reference);
  const TrackedFrame frame = tracker.track(1, 0.04, pair.target);
  return judge_pose_error(frame.trial_T_frame.inverse(), pair.target_T_reference(),
                          frame.registration.observable, frame.status == TrackStatus::tracked);
}

// A step along the coin's rim settles a bead further, on the knurl a tooth, on wood another grain.
TEST(Jumps, OnTextureThatIsAlikeInManyPlacesTheyAreLostOrRight) {
  int wrong_before = 0;
  for (const Jump& jump : {Jump{"coin", 0, 1.5, 0}, Jump{"coin", 0, 3, 0}, Jump{"knurl", 0, 1.5, 0},
                           Jump{"knurl", 1, 3, 0}, Jump{"knurl", 1, 1.5, 0}, Jump{"knurl", 0, 3, 0},
                           Jump{"plank", 1, 0, 10}, Jump{"screw", 0, 2, 0}, Jump{"coin", 0, 2.2, 0}}) {
    const TouchPair pair = make(jump);
    EXPECT_FALSE(follow(pair, true).silent_failure()) << jump.object << ' ' << jump.slide_mm;
    wrong_before += follow(pair, false).silent_failure() ? 1 : 0;
  }
  EXPECT_GE(wrong_before, 4) << "these are no hard cases";
}

TEST(Jumps, WhereTextureIsUniqueTheyAreFollowed) {
  for (const Jump& jump : {Jump{"pebble", 0, 2, 0}, Jump{"peanut", 1, 1.5, 15}, Jump{"coin", 1, 3, 0}}) {
    const Judgement judged = follow(make(jump), true);
    EXPECT_TRUE(judged.tracked && judged.right) << jump.object;
  }
}

}  // namespace
}  // namespace gelslam::lab
