#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/surface/camera_model.hpp"
#include "heights/poisson.hpp"

namespace gelslam::surface::detail {

/// Integrates the heights of a surface from its gradient as a pinhole camera sees it. This is not in the
/// papers, whose camera is orthographic.
///
/// The camera is at the distance D (mm) from the plane z = 0. The rest coordinates X of a pixel are the point
/// (mm) where its ray meets that plane. Along rays the Poisson equation does not hold for z, but for w = D
/// ln(1 + z / D), whose gradient by X is g / (1 - g·X / D), where g is the gradient of the surface. What is
/// integrated is the *relief*: w minus the w of the gel at rest, which may be domed. The relief is 0 where
/// the gel is at rest. For an orthographic camera above a flat gel it is the height.
class HeightIntegrator {
 public:
  explicit HeightIntegrator(const CameraModel& camera);

  /// `gx`, `gy`: the gradient relative to the gel at rest (HxW, dimensionless), to which that of the gel at
  /// rest is added, so that they become the gradient of the surface. Returns the relief of the squares of
  /// PoissonSolver, in pixels and up to a constant.
  cv::Mat1f solve(cv::Mat1f& gx, cv::Mat1f& gy);
  /// Returns the relief of the pixels in mm. `squares`: the result of solve(), to which a smooth correction
  /// may have been added.
  cv::Mat1f relief_mm(const cv::Mat1f& squares) { return poisson_.pixels(squares, pitch_mm_); }
  /// Returns the Poisson solver in the state after the last solve().
  const PoissonSolver& solver() const { return poisson_; }
  /// Replaces the relief of the pixels (mm) by their z in the sensor frame (mm).
  void to_height(cv::Mat1f& relief_mm) const;

 private:
  void to_derivatives(const cv::Mat1f& gx, const cv::Mat1f& gy, int row, cv::Mat1f& dx, cv::Mat1f& dy) const;

  float pitch_mm_, inverse_distance_;
  PoissonSolver poisson_;
  std::vector<float> x_mm_, y_mm_;  // rest coordinates of columns and rows
  // The gel at rest: its gradient, its w, and the derivatives of that w by the rest coordinates.
  cv::Mat1f rest_gx_, rest_gy_, rest_dx_, rest_dy_, rest_w_;
  cv::Mat1f dx_, dy_;  // the derivatives of the relief
};

}  // namespace gelslam::surface::detail
