#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/calibration/press_set.hpp"

namespace gelslam::calibration::detail {

/// Relative color change against the background at some pixels.
struct PressPoints {
  std::vector<double> u_px, v_px;  ///< on the rectified grid
  /// Along x and y, over height: how the point of a ray moves as it rises. Empty for orthographic cameras.
  std::vector<double> rise_x, rise_y;
  std::array<std::vector<double>, 3> change;  ///< B, G, R
};

/// Color difference of a press to the background, relative to the background's brightness, a little smoothed.
/// Both of one size.
cv::Mat3f relative_change(const cv::Mat3b& bgr, const cv::Mat3b& background);

/// About `wanted` points of it on a grid around a contact (of the picture), its membrane rim and some bare
/// gel included.
PressPoints points_around(const ContactCircle& contact, const cv::Mat3f& relative, const CameraModel& camera,
                          double wanted);

/// A pressed ball, on the rectified grid: the gel lies on it inside the radius; outside, the slope falls by a
/// factor e per `decay_px`. The place is that of its rim.
struct PressShape {
  double u_px = 0.0, v_px = 0.0, radius_px = 0.0, decay_px = 0.0;
};

struct PressFit {
  PressShape shape;
  double cost = 0.0;       ///< robust, mean over points
  double explained = 0.0;  ///< 1 - residual / total sum of squares, weighted as in the fit
};

/// Robust least squares (pseudo-Huber) over the shape; for each shape the color function, quadratic in the
/// slope, is solved for per channel (variable projection, Golub & Pereyra 1973; derivatives as simplified by
/// Kaufman 1975).
PressFit fit_press(const PressPoints& points, const PressShape& start, double ball_px);

/// The same with a color function of degree 4, which follows shadows as well: a better center, from a start
/// nearby.
PressFit refine_press(const PressPoints& points, const PressShape& start, double ball_px);

/// A ball that moved evenly by `moved_px` while the picture was taken.
struct SlidPress {
  double radius_px = 0.0, moved_px = 0.0, cost = 0.0;
};
SlidPress fit_slid_press(const PressPoints& points, const PressShape& start, double ball_px);

}  // namespace gelslam::calibration::detail
