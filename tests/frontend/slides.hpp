#pragma once

#include <gtest/gtest.h>

#include "../support/analytic_surface.hpp"

namespace gelslam::test {

// The error of a single registration on such surfaces is at most 0.03 degrees and 0.01 mm
// (tests/registration). In a chain of registrations the errors add up.
inline constexpr double kStepDeg = 0.03, kStepMm = 0.01;

inline const Field& texture() {
  static const Field field = textured_plane(1);
  return field;
}

inline const Field& other_texture() {
  static const Field field = textured_plane(99);
  return field;
}

/// Returns the pose of the sensor in frame `i` of a motion by 0.4 mm and 0.7 degrees of twist per frame.
inline Pose on_the_way(int i) {
  return motion(0.3 * i, -0.2 * i, 0.7 * i, 0.4 * i, 0.05 * i, 0.4 + 0.01 * i);
}

inline SurfacePtr slide(int i, const Field& field = texture()) {
  return touch(field, on_the_way(i), small_view());
}

inline SurfacePtr nothing() {
  static const SurfacePtr surface = touch(texture(), motion(0, 0, 0, 0, 0, -3), small_view());
  return surface;
}

/// The number of frames without contact, at 25 Hz, that end a trial.
inline constexpr int kLiftedFrames = 6;

inline Pose true_motion(int from, int to) { return on_the_way(from).inverse() * on_the_way(to); }

inline void expect_pose(const Pose& found, const Pose& truth, int registrations) {
  expect_within(gap(found, truth), kStepDeg * registrations, kStepMm * registrations);
}

}  // namespace gelslam::test
