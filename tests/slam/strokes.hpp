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

inline Pose stroke_pose(double x_mm, double y_mm, double twist_deg, int step) {
  if (step < 0) return motion(0, 0, 0, 0, 0, -3);  // lifted
  return motion(0.5 * step, 0, twist_deg, x_mm + 0.3 * step, y_mm - 0.2 * step, 0.4);
}

/// The same touches come again and again, and each takes a tenth of a second to make.
inline SurfacePtr touched(double x_mm, double y_mm, double twist_deg, int step, const View& view) {
  static std::map<std::tuple<double, double, double, int, int>, SurfacePtr> made;
  SurfacePtr& surface = made[{x_mm, y_mm, twist_deg, step, view.width_px}];
  if (!surface) surface = touch(ground(), stroke_pose(x_mm, y_mm, twist_deg, step), view);
  return surface;
}

/// Strokes over a textured plane.
class Strokes {
 public:
  explicit Strokes(const ScanRecord& so_far = {}, const View& view = View())
      : view_(view), slam_(SlamOptions{}, so_far), next_(so_far.next_frame()) {}

  void stroke(double x_mm, double y_mm, double twist_deg, bool lift = true) {
    for (int step = 0; step < 3; ++step) {
      truth_[next_] = stroke_pose(x_mm, y_mm, twist_deg, step);
      see(touched(x_mm, y_mm, twist_deg, step, view_));
    }
    if (lift) see(touched(0, 0, 0, -1, view_));
  }
  SlamMap finish(const ScanPart& part = {0, "one", 5, ""}) const {
    SlamMap map = slam_.finish();
    if (map.parts.empty()) map.parts = {part};
    return map;
  }
  const std::map<std::int64_t, Pose>& truth() const { return truth_; }

 private:
  void see(const SurfacePtr& surface) {
    slam_.process(next_, 0.04 * static_cast<double>(next_), surface, timer_);
    ++next_;
  }

  View view_;
  GelSlam slam_;
  StageTimer timer_;
  std::int64_t next_;
  std::map<std::int64_t, Pose> truth_;
};

}  // namespace gelslam::test
