#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "gelslam/slam/live_slam.hpp"
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
  /// Draws with the program of the lines in use.
  void draw() const;

 private:
  GlVertexArray vertex_array_;
  GlBuffer instances_;
  GLsizei count_ = 0;
};

/// Lines of the map are drawn this far outside the touched surface, else the object would hide them.
inline constexpr double kHoverMm = 0.8;

std::vector<SceneLine> trajectory_lines(const std::vector<std::vector<Pose>>& map_T_sensor);
/// A dot and short axes (x red, y green, z blue) per keyframe.
std::vector<SceneLine> keyframe_lines(const MapSnapshot& map);
/// Odometry gray, loops green, loops that the rest contradicts red.
std::vector<SceneLine> edge_lines(const MapSnapshot& map);

}  // namespace gelslam::viewer::detail
