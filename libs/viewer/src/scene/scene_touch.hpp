#pragma once

#include <cstdint>
#include <vector>

#include "gl/gl_objects.hpp"
#include "scene/scene_lines.hpp"

namespace gelslam::viewer::detail {

/// The contact of one frame as a small height field in the map frame.
struct TouchMesh {
  struct Vertex {
    Eigen::Vector3f position_mm, normal;  ///< out of the object
    float inside;                         ///< 0 at the contact's border to 1 well inside; below 0 outside
  };
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;  ///< counter-clockwise from outside
};

/// Every second pixel of a large contact, all of a small one. Pixels that are not finite are left out.
TouchMesh make_touch_mesh(const TouchPatch& touch);

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
