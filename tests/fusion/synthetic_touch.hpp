#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "gelslam/fusion/fusion.hpp"

namespace gelslam::test {

/// An object: signed distance in mm (negative inside), exact or never larger than the true one.
using Shape = std::function<double(const Eigen::Vector3d&)>;

Shape sphere(double radius_mm);
/// A box with edges rounded by `rounding_mm`.
Shape slab(const Eigen::Vector3d& half_size_mm, double rounding_mm);
/// An ellipsoid of revolution about x with bumps of `bump_mm` on it.
Shape bumpy_ellipsoid(double half_length_mm, double radius_mm, double bump_mm);

Eigen::Vector3d outward_normal(const Shape& shape, const Eigen::Vector3d& point_mm);

/// Distance to the surface to first order: value over gradient (exact distance for exact shapes).
double surface_distance(const Shape& shape, const Eigen::Vector3d& point_mm);

/// Standard deviations of what goes wrong in a keyframe.
struct Errors {
  double rotation_rad = 0, translation_mm = 0;  ///< of the pose, per axis
  double height_gain = 0;                       ///< one factor per patch
  double height_noise_mm = 0;                   ///< per pixel, smoothed over a few pixels
};

inline constexpr Errors kUsualErrors{0.006, 0.08, 0.03, 0.01};  // 0.35 degrees, 0.08 mm, 3 %, 0.01 mm

/// Deterministic standard normal numbers.
class Gaussian {
 public:
  explicit Gaussian(std::uint64_t seed) : engine_(seed) {}
  double operator()();

 private:
  std::mt19937_64 engine_;
};

/// The sensor pressed against the shape from `side` (unit, object frame, the way the sensor looks from), with
/// the object's outermost point along the sensor's axis at `depth_mm` below the untouched gel; `twist_rad`
/// about the sensor's axis, `offset_mm` sideways in the sensor's plane.
Pose press(const Shape& shape, const Eigen::Vector3d& side, double depth_mm, double twist_rad,
           const Eigen::Vector2d& offset_mm = Eigen::Vector2d::Zero());

/// What the sensor measures: contact where the object is below the untouched gel, a membrane rim of hanging
/// gel around it which the mask takes for contact over `rim_px` pixels.
/// `camera_distance_mm`: 0: orthographic.
SurfacePtr touch(const Shape& shape, const Pose& object_T_sensor, int rim_px = 2,
                 double camera_distance_mm = 0);

/// `n` presses rolled evenly through a full turn about the object's x axis and along it, with errors.
std::vector<PosedSurface> roll(const Shape& shape, int n, double half_length_mm, double depth_mm,
                               const Errors& errors, std::uint64_t seed);

/// One patch with errors.
PosedSurface with_errors(int id, const Shape& shape, const Pose& object_T_sensor, const Errors& errors,
                         Gaussian& noise);

}  // namespace gelslam::test
