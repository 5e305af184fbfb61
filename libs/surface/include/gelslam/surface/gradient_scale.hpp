#pragma once

namespace gelslam {

/// Read slope over true slope, along the sensor's x and along its y: networks trained on presses of balls err
/// by a few per cent, and not by the same along both.
struct GradientScale {
  double x = 1.0, y = 1.0;
  double mean() const { return 0.5 * (x + y); }
};

}  // namespace gelslam
