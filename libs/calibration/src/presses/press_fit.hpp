#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/calibration/press_set.hpp"

namespace gelslam::calibration::detail {

/// Relative color change of some pixels compared with the background.
struct PressPoints {
  std::vector<double> u_px, v_px;  ///< on the rectified grid
  /// Derivative of x and y with respect to height along the ray of each pixel. Empty for orthographic
  /// cameras.
  std::vector<double> rise_x, rise_y;
  std::array<std::vector<double>, 3> change;  ///< B, G, R
};

/// Returns the difference between press and background, divided by the background's brightness, slightly
/// smoothed. Both images must have the same size.
cv::Mat3f relative_change(const cv::Mat3b& bgr, const cv::Mat3b& background);

/// Returns about `wanted` pixels of the relative change on a regular grid around a contact (in image pixels),
/// including the rim of the membrane and some bare gel.
PressPoints points_around(const ContactCircle& contact, const cv::Mat3f& relative, const CameraModel& camera,
                          double wanted);

/// Shape of a press on the rectified grid. Inside the radius the gel touches the ball; outside, its slope
/// falls by a factor e per `decay_px`. The center is that of the rim.
struct PressShape {
  double u_px = 0.0, v_px = 0.0, radius_px = 0.0, decay_px = 0.0;
};

struct PressFit {
  PressShape shape;
  double cost = 0.0;       ///< Robust cost, mean over the points.
  double explained = 0.0;  ///< 1 - residual / total sum of squares, weighted as in the fit
};

/// Fits the shape by robust least squares (pseudo-Huber). For each shape the best color function, quadratic
/// in the slope, is computed for each channel (variable projection, Golub & Pereyra 1973; derivatives as
/// simplified by Kaufman 1975).
PressFit fit_press(const PressPoints& points, const PressShape& start, double ball_px);

/// As fit_press(), with a color function of degree 4, which can follow shadows. It gives a more accurate
/// center but needs a good start.
PressFit refine_press(const PressPoints& points, const PressShape& start, double ball_px);

/// Shape of a ball that moved at constant speed by `moved_px` during the exposure.
struct SlidPress {
  double radius_px = 0.0, moved_px = 0.0, cost = 0.0;
};
SlidPress fit_slid_press(const PressPoints& points, const PressShape& start, double ball_px);

}  // namespace gelslam::calibration::detail
