#pragma once

#include <array>
#include <cstddef>
#include <opencv2/core/mat.hpp>
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
  std::size_t measurements = 0;  ///< dots, or pairs of frames
  double residual = 0;           ///< root mean square per axis; pixels, or rad of the normals

  /// For people: a line per number, "lens_k1: 0.045 +- 0.002".
  std::string words() const;
  /// Names of the numbers that are not shown, or "".
  std::string not_shown() const;
};

/// From a picture of the bare gel with printed dots, in a square grid that may be turned (own). The gel's
/// dome hides in the lens, and the camera's distance in both, so that `start` has to know these. Throws Error
/// when there are fewer than 20 dots, or no grid.
OpticsFit optics_from_dots(const cv::Mat3b& picture, double pixel_pitch_mm, const SensorOptics& start);

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
