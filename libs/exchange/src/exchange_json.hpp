#pragma once

#include <cmath>

namespace gelslam::exchange::detail {

/// To a nanometer: short in text.
inline double meters(double mm) { return std::round(mm * 1e6) / 1e9; }

}  // namespace gelslam::exchange::detail
