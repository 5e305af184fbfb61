#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gelslam {

enum class SceneShading {
  clay,       ///< Gray under two lamps.
  curvature,  ///< Grazing light with dark valleys and bright ridges, which shows the finest texture.
};

enum class SceneColor {
  plain,
  /// Number of keyframes that touched the place; a keyframe counts less near the border of its contact.
  confidence,
  height,     ///< Along -z of the map, out of the object on the gel's side of the first touch.
  distance,   ///< to another surface, see Scene::set_mesh()
  certainty,  ///< Plain, tinted where few keyframes touched or the pose is uncertain.
};

struct SceneStyle {
  SceneShading shading = SceneShading::clay;
  SceneColor color = SceneColor::plain;
  Eigen::Vector3f plain_rgb{0.58F, 0.50F, 0.43F};  ///< Linear RGB, gray-brown.
  bool touch = true, sensor = true, trajectory = false;
  bool keyframes = false, edges = false;
  bool not_in_mesh = false;  ///< Shows what was touched and is not in the mesh.
  bool smooth_border =
      false;  ///< The mesh is cut where confidence falls below a limit, and not at its last triangle.
  /// Values at the ends of the color map; empty: the range in the mesh.
  std::optional<std::array<float, 2>> range{};
};

/// Meaning of the mesh's colors: `colors` from `min` to `max`, for a color bar.
struct ColorLegend {
  std::string title;  ///< "distance"
  std::string unit;   ///< "mm", or ""
  float min = 0, max = 1;
  std::vector<std::array<std::uint8_t, 3>> colors_rgb;
  std::vector<std::string> notes;  ///< "mean 0.031 mm"
};

}  // namespace gelslam
