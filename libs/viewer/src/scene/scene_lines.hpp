#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "gl/gl_objects.hpp"

namespace gelslam::viewer::detail {

using Rgba = std::array<std::uint8_t, 4>;

/// A line of constant width on the screen with round ends; a dot when both ends are one place.
struct SceneLine {
  Eigen::Vector3f from_mm, to_mm;
  Rgba color;
  float width_px;
};

/// Lines on the GPU (OpenGL's own are one pixel wide).
class SceneLines {
 public:
  SceneLines();
  void set(const std::vector<SceneLine>& lines);
  bool empty() const { return count_ == 0; }
  /// Draws with the program of the lines in use.
  void draw() const;

 private:
  GlVertexArray vertex_array_;
  GlBuffer instances_;
  GLsizei count_ = 0;
};

}  // namespace gelslam::viewer::detail
