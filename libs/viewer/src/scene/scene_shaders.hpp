#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "gelslam/viewer/scene_style.hpp"

namespace gelslam::viewer::detail {

// GLSL 3.30. Suffixes say the frame: _m map, _c camera (x right, y up, z toward the viewer), _px pixels.
extern const char* const mesh_vertex_shader;
extern const char* const mesh_fragment_shader;
extern const char* const touch_vertex_shader;
extern const char* const touch_fragment_shader;
extern const char* const line_vertex_shader;
extern const char* const line_fragment_shader;
extern const char* const background_vertex_shader;
extern const char* const background_fragment_shader;

/// What a polished ball reflects, seen from the front: a square picture of that side, RGBA, bottom row first.
std::vector<std::uint8_t> make_matcap(int side_px);

}  // namespace gelslam::viewer::detail
