#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "gelslam/slam/live_slam.hpp"
#include "gl/gl_objects.hpp"

namespace gelslam::viewer::detail {

using Rgba = std::array<std::uint8_t, 4>;

/// A line of constant width on the screen with round ends; a dot if both ends coincide.
struct SceneLine {
  Eigen::Vector3f from_mm, to_mm;
  Rgba color;
  float width_px;
};

/// Lines on the GPU (OpenGL's own lines are one pixel wide).
class SceneLines {
 public:
  SceneLines();
  void set(const std::vector<SceneLine>& lines);
  /// Draws with the current program, which must be that of the lines.
  void draw() const;

 private:
  GlVertexArray vertex_array_;
  GlBuffer instances_;
  GLsizei count_ = 0;
};

/// Lines of the map are drawn this far outside the touched surface, because otherwise the object would hide
/// them.
inline constexpr double kHoverMm = 0.8;

std::vector<SceneLine> trajectory_lines(const std::vector<std::vector<Pose>>& map_T_sensor);
/// A dot and short axes (x red, y green, z blue) for each keyframe.
std::vector<SceneLine> keyframe_lines(const MapSnapshot& map);
/// Odometry is gray, loops are green, loop outliers are red.
std::vector<SceneLine> edge_lines(const MapSnapshot& map);

}  // namespace gelslam::viewer::detail
