#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/surface/camera_model.hpp"
#include "heights/poisson.hpp"

namespace gelslam::surface::detail {

/// Integrates heights from the slopes that a camera sees (own). Behind a camera at distance D, w = D ln(1 + z
/// / D) has the derivatives grad w = g / (1 - g·X / D) by the rest coordinates X, where g are the surface's
/// slopes. Relief is w less that of the gel at rest: 0 where nothing touches, and for an orthographic camera
/// above a flat gel the height itself.
class HeightIntegrator {
 public:
  explicit HeightIntegrator(const CameraModel& camera);

  /// gx, gy: slopes relative to the gel at rest, dimensionless; they become the surface's own. Returns the
  /// relief of PoissonSolver's squares, in pixels, up to a constant.
  cv::Mat1f solve(cv::Mat1f& gx, cv::Mat1f& gy);
  /// Returns the relief of the pixels, mm. `squares`: what solve() returned; smooth relief may have been
  /// added.
  cv::Mat1f relief_mm(const cv::Mat1f& squares) { return poisson_.pixels(squares, pitch_mm_); }
  /// Returns the solver as solve() left it.
  const PoissonSolver& solver() const { return poisson_; }
  /// Turns relief into height in the sensor frame.
  void to_height(cv::Mat1f& relief_mm) const;

 private:
  void to_derivatives(const cv::Mat1f& gx, const cv::Mat1f& gy, int row, cv::Mat1f& dx, cv::Mat1f& dy) const;

  float pitch_mm_, inverse_distance_;
  PoissonSolver poisson_;
  std::vector<float> x_mm_, y_mm_;                            // rest coordinates of columns and rows
  cv::Mat1f rest_gx_, rest_gy_, rest_dx_, rest_dy_, rest_w_;  // of the gel at rest; d: of w
  cv::Mat1f dx_, dy_;                                         // of the relief
};

}  // namespace gelslam::surface::detail
