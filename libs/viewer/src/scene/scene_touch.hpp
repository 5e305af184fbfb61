#pragma once

#include <cstdint>
#include <vector>

#include "gl/gl_objects.hpp"
#include "scene/scene_lines.hpp"
#include "scene/touch_mesh.hpp"

namespace gelslam::viewer::detail {

/// The sensor's field of view at its pose.
std::vector<SceneLine> sensor_outline(const TouchPatch& touch, const Rgba& color);

class SceneTouch {
 public:
  SceneTouch();
  void set(const TouchMesh& mesh);
  void draw() const;  ///< with the program of the touch in use

 private:
  GlVertexArray vertex_array_;
  GlBuffer vertices_, indices_;
  GLsizei count_ = 0;
};

}  // namespace gelslam::viewer::detail
