#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// Optics found by a fit.
struct OpticsFit {
  static constexpr std::size_t kNumbers = 7;
  /// k, principal point x, y, aspect, distance, a, b: standard deviations in the units of SensorOptics, and
  /// whether the data show the number. What they do not show is as it was before.
  std::array<double, kNumbers> sigma{};
  std::array<bool, kNumbers> shown{};
  SensorOptics optics;
  std::size_t measurements = 0;  ///< pairs of frames
  double residual = 0;           ///< of the normals, rad: root mean square per axis

  /// For people: a line per number, "lens_k1: 0.045 +- 0.002".
  std::string words() const;
  /// Names of the numbers that are not shown, or "".
  std::string not_shown() const;
};

/// What a sensor that is moved over an object saw, and where it was.
struct SeenFrame {
  SurfacePtr surface;
  Pose world_T_frame = Pose::Identity();
};

/// From a scan (own): a rigid body looks the same in whatever part of the picture it lies. Poses and optics
/// are found together by least squares over the normals and heights of overlapping contacts (bundle
/// adjustment). Standard deviations allow for errors that frames in a row have in common (sandwich estimator,
/// White 1980). Throws Error when fewer than ten pairs of frames overlap.
OpticsFit optics_from_motion(const std::vector<SeenFrame>& frames);

}  // namespace gelslam
