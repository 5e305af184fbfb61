#pragma once

#include <map>
#include <tuple>

#include "../support/analytic_surface.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "gelslam/slam/scan_record.hpp"

namespace gelslam::test {

inline const Field& ground() {
  static const Field field = textured_plane(1);
  return field;
}

inline constexpr int kLiftedFrames = 6;
inline const Pose kLifted = motion(0, 0, 0, 0, 0, -3);

inline Pose stroke_pose(double x_mm, double y_mm, double twist_deg, int step) {
  return motion(0.5 * step, 0, twist_deg, x_mm + 0.3 * step, y_mm - 0.2 * step, 0.4);
}

/// Returns the surface of a touch. Surfaces are cached, because each takes a tenth of a second to compute and
/// many tests use the same ones.
inline SurfacePtr touched(double x_mm, double y_mm, double twist_deg, int step, const View& view) {
  static std::map<std::tuple<double, double, double, int, int>, SurfacePtr> made;
  SurfacePtr& surface = made[{x_mm, y_mm, twist_deg, step, view.width_px}];
  if (!surface) surface = touch(ground(), stroke_pose(x_mm, y_mm, twist_deg, step), view);
  return surface;
}

/// A scan of strokes over a textured plane, or of other touches of it.
class Strokes {
 public:
  explicit Strokes(const ScanRecord& so_far = {}, const View& view = View(), Field field = ground())
      : field_(std::move(field)), view_(view), slam_(SlamOptions{}, so_far), next_(so_far.next_frame()) {}

  /// Adds a stroke of three touches, after which the sensor is lifted.
  void stroke(double x_mm, double y_mm, double twist_deg) {
    for (int step = 0; step < 3; ++step) {
      truth_[next_] = stroke_pose(x_mm, y_mm, twist_deg, step);
      process(touched(x_mm, y_mm, twist_deg, step, view_));
    }
    lift();
  }
  TrackedFrame see(const Pose& ground_T_sensor) {
    truth_[next_] = ground_T_sensor;
    return process(touch(field_, ground_T_sensor, view_));
  }
  void lift() {  // for 0.24 s, which ends the trial
    static const SurfacePtr nothing = touch(ground(), kLifted);
    for (int i = 0; i < kLiftedFrames; ++i) process(nothing);
  }
  void background(int count) {
    for (int i = 0; i < count; ++i) slam_.process(next_++, 0, nullptr, timer_);
  }
  SlamMap finish() const {
    SlamMap map = slam_.finish();
    if (map.parts.empty()) map.parts = {{0, "one", 5, ""}};
    return map;
  }
  const std::map<std::int64_t, Pose>& truth() const { return truth_; }

 private:
  TrackedFrame process(const SurfacePtr& surface) {
    const std::int64_t frame = next_++;
    return slam_.process(frame, 0.04 * static_cast<double>(frame), surface, timer_);
  }

  Field field_;  ///< the object that see() touches
  View view_;
  GelSlam slam_;
  StageTimer timer_;
  std::int64_t next_;
  std::map<std::int64_t, Pose> truth_;
};

}  // namespace gelslam::test
