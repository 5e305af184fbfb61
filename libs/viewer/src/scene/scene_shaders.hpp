#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "gelslam/viewer/scene_style.hpp"

namespace gelslam::viewer::detail {

// GLSL 3.30. Suffixes say the frame: _m map, _c camera (x right, y up, z toward the viewer), _px pixels.
extern const char* const kMeshVertexShader;
extern const char* const kMeshFragmentShader;
extern const char* const kTouchVertexShader;
extern const char* const kTouchFragmentShader;
extern const char* const kLineVertexShader;
extern const char* const kLineFragmentShader;
extern const char* const kBackgroundVertexShader;
extern const char* const kBackgroundFragmentShader;

/// What a polished ball reflects, seen from the front: a square picture of that side, RGBA, bottom row first.
std::vector<std::uint8_t> make_matcap(int side_px);

}  // namespace gelslam::viewer::detail
