#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "gelslam/viewer/scene_style.hpp"

namespace gelslam::viewer::detail {

/// 256 colors from low to high: even steps to the eye (viridis; distances from pale to dark, so that a right
/// surface looks untouched; keyframes run through the hues, their numbers being names).
std::vector<std::array<std::uint8_t, 3>> color_map_rgb(SceneColor color);

/// What a polished ball reflects, seen from the front: a square picture of that side, RGBA, bottom row first.
std::vector<std::uint8_t> make_matcap(int side_px);

}  // namespace gelslam::viewer::detail
