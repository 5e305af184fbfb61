#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace gelslam {

/// What a surface's colors show. Every map is perceptually uniform and readable when color-blind: confidence
/// viridis, height cividis, distance from pale to dark (magma), so that a good surface looks
/// untouched.
enum class ColorMap { confidence, height, distance };

/// 256 colors from low to high.
std::vector<std::array<std::uint8_t, 3>> color_map_rgb(ColorMap map);

}  // namespace gelslam
