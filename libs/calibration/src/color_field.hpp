#pragma once

#include <array>
#include <vector>

#include "slope_samples.hpp"

namespace gelslam::calibration::detail {

/// How colour follows slope and place on the whole gel, smoothly: for each channel, the change against the
/// background is a polynomial in the slope angles (degree 4, without constant) whose coefficients are
/// polynomials in the place (degree 4). Least squares with a ridge that grows with the degree.
class ColorField {
 public:
  explicit ColorField(const std::vector<SlopeSample>& samples);

  /// Colour change (BGR, 0..1) that a slope makes at a place (u/W, v/H).
  std::array<float, 3> change(const std::array<float, 2>& place, const std::array<float, 2>& angle_rad) const;

 private:
  static constexpr int slope_terms = 14, place_terms = 15;
  std::array<std::array<float, slope_terms * place_terms>, 3> coefficients_{};
};

}  // namespace gelslam::calibration::detail
