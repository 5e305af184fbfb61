#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// Read slope over true slope, along the sensor's x and along its y: networks trained on presses of balls err
/// by a few per cent, and not by the same along both.
struct GradientScale {
  double x = 1.0, y = 1.0;
  double mean() const { return 0.5 * (x + y); }
};

/// The error of a color model as a few numbers: true slope = read slope - sum of factor * term. Nothing
/// where the gel is flat. A model trained on presses of balls errs by a few per cent of the slope, not by the
/// same along x and y (GradientScale), unevenly over the gel, more on slopes toward one lamp than toward
/// another, and differently on small slopes, which look like bare gel, than on steep ones. The factors are
/// unknowns that all edges of the pose graph share. Source: own.
struct SlopeCorrection {
  /// Terms of one axis, of read slopes gx, gy at (x, y) in half image widths from the center, with
  /// m = 1 / sqrt(1 + gx² + gy²) and a weight s of small slopes, exp(-|g| / 0.07): gx, gy, x gx, y gx, x gy,
  /// y gy, m gx², m gx gy, m gy², s times the slope of this axis, and in contact x and y.
  static constexpr std::size_t kTermsPerAxis = 12;
  static constexpr std::size_t kTerms = 2 * kTermsPerAxis;
  using AxisTerms = std::array<float, kTermsPerAxis>;
  using Terms = std::array<AxisTerms, 2>;  ///< of the slope along x and along y

  std::array<double, kTerms> factors{};  ///< first those of the slope along x, then along y

  /// Index of the factor that scales the slope along the axis it corrects.
  static constexpr std::size_t kScaleX = 0, kScaleY = kTermsPerAxis + 1;
  static constexpr std::size_t kSmallSlopes = 9;  ///< of an axis's terms
  /// The subset that maps read to true slopes linearly: xx, xy, yx, yy. How an edge of the pose graph depends
  /// on them is known without surfaces (motion_by_gradient_scale()); they are estimated while a scan goes on.
  static constexpr std::array<std::size_t, 4> kLinear = {kScaleX, 1, kTermsPerAxis, kScaleY};
  static SlopeCorrection from_linear(const Eigen::VectorXd& factors);  ///< four, or none for no correction
  Eigen::Vector4d linear() const;
  GradientScale scale() const;  ///< at the center of the gel
  /// (x, y) of a pixel, as terms() takes it.
  static cv::Point2f place(cv::Size size, cv::Point pixel);
  static Terms terms(float x, float y, float gx, float gy);
  /// Prior standard deviation of each factor (about 0). It is smaller for a model that states a smaller
  /// standard deviation of its slopes (`model_sigma`: Surface::model_sigma).
  static std::array<double, kTerms> prior_sigma(double gradient_scale_sigma, double model_sigma = 1.0);
};

/// Applies corrections to surfaces. Not thread-safe: it keeps the work buffers of the last size.
class SlopeCorrector {
 public:
  SlopeCorrector();
  ~SlopeCorrector();

  /// The surface with corrected slopes and heights integrated from them. Contact and curvature, which select
  /// pixels and places, stay as they are.
  SurfacePtr apply(const Surface& read, const SlopeCorrection& correction);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
