#pragma once

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

}  // namespace gelslam::viewer::detail
