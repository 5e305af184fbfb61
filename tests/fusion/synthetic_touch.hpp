#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "../support/analytic_surface.hpp"
#include "gelslam/fusion/fusion.hpp"

namespace gelslam::test {

/// A box with edges rounded by `rounding_mm`.
Field slab(const Eigen::Vector3d& half_size_mm, double rounding_mm);
/// An oblong pebble.
inline Field pebble() { return bumpy_ellipsoid(8, {8, 4, 4}, 0.25, 4); }

/// Standard deviations of what goes wrong in a keyframe.
struct Errors {
  double rotation_rad = 0, translation_mm = 0;  ///< of the pose, per axis
  double height_gain = 0;                       ///< one factor per patch
  double height_noise_mm = 0;                   ///< per pixel, smoothed over a few pixels
};

inline constexpr Errors kUsualErrors{0.006, 0.08, 0.03, 0.01};  // 0.35 degrees, 0.08 mm, 3 %, 0.01 mm

/// The sensor pressed against the object from `side` (unit, object frame, the way the sensor looks from),
/// with the object's outermost point along the sensor's axis at `depth_mm` below the untouched gel;
/// `twist_rad` about the sensor's axis, `offset_mm` sideways in the sensor's plane.
Pose press(const Field& field, const Eigen::Vector3d& side, double depth_mm, double twist_rad,
           const Eigen::Vector2d& offset_mm = Eigen::Vector2d::Zero());

/// What a gel measures there: a membrane on an elastic foundation, which returns to rest over 0.7 mm, pressed
/// down by the object. The contact is where it lies on the object.
SurfacePtr measured(const Field& field, const Pose& object_T_sensor);

inline constexpr double kRadiusMm = 6.0;
inline const Field kBall = sphere(kRadiusMm);
inline const Pose kPressed = press(kBall, {0, 0, 1}, 1.0, 0.2);
inline const PosedSurface kPatch{1, kPressed, measured(kBall, kPressed)};

/// `n` presses rolled evenly through a full turn about the object's x axis and along it, with errors.
std::vector<PosedSurface> roll(const Field& field, int n, double half_length_mm, double depth_mm,
                               const Errors& errors, std::uint64_t seed);

/// One patch with errors.
PosedSurface with_errors(int id, const Field& field, const Pose& object_T_sensor, const Errors& errors,
                         std::mt19937_64& random);

}  // namespace gelslam::test
