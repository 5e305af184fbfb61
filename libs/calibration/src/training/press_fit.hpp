#pragma once

#include <array>
#include <vector>

namespace gelslam::calibration::detail {

/// Relative color change against the background at some pixels.
struct PressPoints {
  std::vector<double> u_px, v_px;
  std::array<std::vector<double>, 3> change;  ///< B, G, R
};

/// A pressed ball: the gel lies on it inside the radius; outside, the slope falls by a factor e per
/// `decay_px`.
struct PressShape {
  double u_px = 0.0, v_px = 0.0, radius_px = 0.0, decay_px = 0.0;
};

struct PressFit {
  PressShape shape;
  double cost = 0.0;       ///< robust, mean over points
  double explained = 0.0;  ///< 1 - residual / total sum of squares, weighted as in the fit
};

/// Levenberg-Marquardt over the shape; for each shape the color function (quadratic in the slope, per
/// channel) is solved exactly (variable projection, Golub & Pereyra 1973; derivatives as simplified by
/// Kaufman 1975). Pseudo-Huber loss.
PressFit fit_press(const PressPoints& points, const PressShape& start, double ball_px);

/// The same with a color function of degree 4, which follows shadows as well: a better center, from a start
/// nearby.
PressFit refine_press(const PressPoints& points, const PressShape& start, double ball_px);

/// A ball that moved evenly by `moved_px` while the picture was taken.
struct SlidPress {
  double radius_px = 0.0, moved_px = 0.0, cost = 0.0;
};
SlidPress fit_slid_press(const PressPoints& points, const PressShape& start, double ball_px);

/// Cost of the best press in a picture that is blurred alike in all directions, as a soft gel looks, too.
double blurred_cost(const PressPoints& points, const PressShape& start, double ball_px);

}  // namespace gelslam::calibration::detail
