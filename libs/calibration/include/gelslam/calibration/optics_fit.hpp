#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// Optics estimated by a fit.
struct OpticsFit {
  static constexpr std::size_t kNumbers = 7;
  /// For the seven numbers k, principal point x, y, aspect, distance, a, b: standard deviations in the units
  /// of SensorOptics, and whether the data determine the number. A number that they do not determine keeps
  /// its initial value.
  std::array<double, kNumbers> sigma{};
  std::array<bool, kNumbers> shown{};
  SensorOptics optics;
  std::size_t measurements = 0;  ///< Pairs of frames.
  double residual = 0;           ///< Root mean square residual of the normals in rad, per axis.

  /// Returns a line for each number, for the user: "lens_k1: 0.045 +- 0.002".
  std::string words() const;
  /// Returns the names of the numbers that the data do not determine, or "".
  std::string not_shown() const;
};

/// A frame of a sensor that is moved over an object, with its pose.
struct SeenFrame {
  SurfacePtr surface;
  Pose world_T_frame = Pose::Identity();
};

/// Estimates the optics from a scan (not in the paper). A rigid object has the same shape wherever in the
/// image it appears. Poses and optics are estimated together by least squares on the normals and heights of
/// overlapping contacts (bundle adjustment). The standard deviations take into account that consecutive
/// frames have common errors (sandwich estimator, White 1980). Throws Error when fewer than ten pairs of
/// frames overlap.
OpticsFit optics_from_motion(const std::vector<SeenFrame>& frames);

}  // namespace gelslam
