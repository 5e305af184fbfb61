#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// What a color model reads wrong, as a few numbers: true slope = read slope - sum of factor * term. Nothing
/// where the gel is flat. A model trained on presses of balls errs by a few per cent of the slope, not by the
/// same along x and y (gradient_scale), unevenly over the gel, and more on slopes toward one lamp than toward
/// another. Source: own.
struct SlopeCorrection {
  /// Terms of one axis, of read slopes gx, gy at (x, y) in half image widths from the center, with
  /// m = 1 / sqrt(1 + gx² + gy²): gx, gy, x gx, y gx, x gy, y gy, m gx², m gx gy, m gy², and in contact x and
  /// y.
  static constexpr std::size_t kTermsPerAxis = 11;
  static constexpr std::size_t kTerms = 2 * kTermsPerAxis;
  using AxisTerms = std::array<float, kTermsPerAxis>;

  std::array<double, kTerms> factors{};  ///< first those of the slope along x, then along y

  /// Of a model that reads slopes along x and y too steep by these.
  static SlopeCorrection of_gain(double gain_x, double gain_y);
  double gain_x() const;  ///< read over true slopes along x, at the center: what of_gain() was given
  double gain_y() const;
  /// (x, y) of a pixel, as terms() takes it.
  static cv::Point2f place(cv::Size size, cv::Point pixel);
  static AxisTerms terms(float x, float y, float gx, float gy);
  /// How far a factor may be from 0, before anything is known: one standard deviation each.
  static std::array<double, kTerms> prior_sigma(double gain_sigma);
};

/// Applies corrections to surfaces of one size. Not thread-safe: it keeps work buffers.
class SlopeCorrector {
 public:
  explicit SlopeCorrector(cv::Size size);
  ~SlopeCorrector();

  /// The surface with slopes corrected and heights integrated from them; contact and curvature (which decide
  /// what is looked at) stay. `size` as given.
  SurfacePtr apply(const Surface& read, const SlopeCorrection& correction);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
