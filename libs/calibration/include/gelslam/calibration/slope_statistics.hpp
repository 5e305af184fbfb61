#pragma once

#include <array>
#include <vector>

#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/calibration/press_set.hpp"
#include "gelslam/surface/gradient_model.hpp"

namespace gelslam {

/// Gradients dh/dx, dh/dy of one pixel of a BallZone, in which the gel certainly touches the ball, relative
/// to the gel at rest: as the model reads them, and as they are on the ball.
struct ZoneReading {
  int u = 0, v = 0;
  std::array<double, 2> read{};
  std::array<double, 2> labeled{};  ///< Slopes of a ball at the zone's center.
  /// Slopes of a ball whose center was estimated from the read slopes, so that an error of the circle does
  /// not count as an error of the gradient scale.
  std::array<double, 2> truth{};
};

/// Reads the zone of a press with the model. Pixels that markers cover are left out. Throws Error when the
/// model does not match the image size.
std::vector<ZoneReading> read_zone(const GradientModel& model, const PressSet& set, const BallZone& zone,
                                   double pixel_pitch_mm);

/// Sums for the regression of read on true slopes over some pixels.
struct SlopeSums {
  std::array<double, 2> read_true{}, true_true{};  ///< x, y
  double abs_error_deg = 0.0;  ///< Absolute errors against the labeled slopes, summed over both axes.
  double pixels = 0.0;

  void add(const ZoneReading& pixel);
  /// Factor of the regression of read on true gradients through 0; 1 is unbiased. NaN without pixels.
  double scale_x() const { return read_true[0] / true_true[0]; }
  double scale_y() const { return read_true[1] / true_true[1]; }
  double scale() const { return (read_true[0] + read_true[1]) / (true_true[0] + true_true[1]); }
  /// Mean per axis, of the slope angles.
  double mean_abs_error_deg() const { return abs_error_deg / (2.0 * pixels); }
};

/// SlopeSums over the whole gel and over its parts.
struct SlopeStatistics {
  SlopeSums all;
  std::array<SlopeSums, 9> ninths;  ///< Ninths of the gel, row by row.

  /// `picture` is the size of the press's image.
  void add(const ZoneReading& pixel, const cv::Size& picture);
};

}  // namespace gelslam
