#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace gelslam {

/// Quantities that are shown by colors on a surface. All color maps are perceptually uniform and suitable for
/// color-blind people: viridis for confidence, cividis for height, and magma from pale to dark for distance,
/// so that an accurate surface looks uncolored.
enum class ColorMap { confidence, height, distance };

/// Returns 256 colors from low to high.
std::vector<std::array<std::uint8_t, 3>> color_map_rgb(ColorMap map);

}  // namespace gelslam
