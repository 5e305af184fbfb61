#pragma once

#include <Eigen/Core>
#include <memory>

#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// Read slope over true slope, along the sensor's x and along its y: networks trained on presses of balls err
/// by a few per cent, and not by the same along both.
struct GradientScale {
  double x = 1.0, y = 1.0;
  double mean() const { return 0.5 * (x + y); }
};

/// The error of a color model as four numbers: true slope = (I - F) * read slope, both relative to the gel at
/// rest, with F = ((xx, xy), (yx, yy)) along the sensor's axes. The factors are unknowns that all edges of
/// the pose graph share (motion_by_gradient_scale()). Source: own.
struct SlopeCorrection {
  Eigen::Vector4d factors = Eigen::Vector4d::Zero();  ///< xx, xy, yx, yy

  /// Of the pose graph's shared unknowns: four, or none for no correction.
  static SlopeCorrection from_unknowns(const Eigen::VectorXd& unknowns);
  GradientScale scale() const;
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
