#pragma once

#include <cstdint>
#include <random>

#include "gelslam/simulation/gel.hpp"
#include "gelslam/simulation/shape.hpp"

namespace gelslam::lab {

/// Holds a simulated object on the gel at a steady depth and rolls it (slides it, where it is flat) toward
/// where it is told, at a bounded speed and not quite steadily. Deterministic.
class VirtualHand {
 public:
  static constexpr double kRateHz = 25;

  /// `speed_mm_s`: of the touch over the object's surface.
  VirtualHand(ShapePtr shape, const SensorGeometry& geometry, double speed_mm_s, std::uint64_t seed);

  /// Puts it down with its point in `direction` (object frame) on the gel's middle; of a rod and a flat
  /// object, whose turns are limited, with `place_mm` (object frame) above the gel's middle.
  void put(const Eigen::Vector3d& direction, const Eigen::Vector2d& place_mm = {0, 0});
  /// Goes on for one frame. `direction`: unit, in the sensor's x and y, where the touch should go on the
  /// object. False when the object ends there.
  bool move(const Eigen::Vector2d& direction);
  /// The gel as it is now.
  const GelShape& press() const { return gel_; }
  const Pose& sensor_T_object() const { return sensor_T_object_; }
  const Shape& shape() const { return *shape_; }
  /// How far the gel's middle may go from the object's, along its x and y.
  Eigen::Vector2d reach_mm() const;
  /// The gel's middle in the object frame.
  Eigen::Vector3d place_mm() const { return sensor_T_object_.inverse().translation(); }

 private:
  void settle(double depth_mm);
  void center(double gain);
  bool slide(const Eigen::Vector2d& step_mm);

  ShapePtr shape_;
  SensorGeometry geometry_;
  double step_mm_;
  std::mt19937_64 random_;
  Eigen::Vector3d push_ = Eigen::Vector3d::Zero();      ///< what the hand gives way to, slowly
  Eigen::Vector3d unsteady_ = Eigen::Vector3d::Zero();  ///< of heading, twist and depth
  Pose sensor_T_object_ = Pose::Identity();
  GelShape gel_;
  int frames_ = 0;  ///< since it was put down
};

/// Which of these points of the object's surface the hand can touch at all, in any position.
std::vector<bool> reachable(const ShapePtr& shape, const SensorGeometry& geometry,
                            const std::vector<Eigen::Vector3d>& points_mm);

}  // namespace gelslam::lab
