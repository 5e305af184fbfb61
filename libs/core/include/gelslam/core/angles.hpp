#pragma once

#include <numbers>

namespace gelslam {

inline constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;

}  // namespace gelslam
