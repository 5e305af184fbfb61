#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/simulation/sensor_geometry.hpp"
#include "gelslam/simulation/shape.hpp"

namespace gelslam {

struct MotionSpec {
  std::string name = "wobble";  ///< see motion_catalogue()
  int frames = 245;             ///< pictures with the object near, without the background frames
  double speed = 1.0;           ///< factor on the excursions (wobble, slide, roll, twist), 0 .. 5
  double indentation_mm = 0.5;  ///< what the deepest point is held at, roughly: 0.05 .. 1.5
  Eigen::Vector2d place_mm = {0,
                              0};  ///< where on the gel the contact is, from its center; may leave the view
  double frame_rate_hz = 25.0;
  std::uint64_t seed = 1;
  int turn_after = 0;  ///< frames after which the motion goes back, and so to and fro; 0: never
};

std::vector<CatalogueEntry> motion_catalogue();

/// sensor_T_object for every frame (mm). The support height follows the object so that its deepest point over
/// the sensor stays near the target indentation, smoothed over a few frames as a hand would; the first frames
/// press in. The last row of a lifted phase lies clear of the gel. Deterministic. Throws Error for an unknown
/// name or parameters out of range. `surface`: the object's mesh (a millimeter or finer).
std::vector<Pose> make_motion(const MotionSpec& spec, const Shape& shape, const Mesh& surface,
                              const SensorGeometry& geometry);

}  // namespace gelslam
