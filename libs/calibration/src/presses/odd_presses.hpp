#pragma once

#include <cstddef>
#include <vector>

#include "gelslam/calibration/ball_zones.hpp"

namespace gelslam::calibration::detail {

/// Zones whose colors are not those that the same slopes have at the same places in the other presses (own):
/// their residual to a smooth model of the gel's colors is three times the median one. The worst is taken
/// out, the model fitted again, and so on; never more than a quarter. Indices in growing order.
std::vector<std::size_t> find_odd_zones(const PressSet& set, const std::vector<BallZone>& zones,
                                        double pixel_pitch_mm);

}  // namespace gelslam::calibration::detail
