#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gelslam {

enum class SceneShading {
  clay,       ///< under two lamps
  curvature,  ///< grazing light, hollows dark and ridges bright: shows the finest texture
};

enum class SceneColor {
  plain,
  confidence,  ///< how many keyframes touched here; one counts less near its contact's border
  height,      ///< along -z of the map: out of the gel's side of the first touch
  distance,    ///< to another surface, see Scene::set_mesh()
  certainty,   ///< plain, tinted where few keyframes touched or the place is not well known
};

struct SceneStyle {
  SceneShading shading = SceneShading::clay;
  SceneColor color = SceneColor::plain;
  Eigen::Vector3f plain_rgb{0.58F, 0.50F, 0.43F};  ///< linear; clay
  bool touch = true, sensor = true, trajectory = false;
  bool keyframes = false, edges = false;
  bool not_in_mesh = false;  ///< what was touched and is not in the mesh
  bool smooth_border =
      false;  ///< the mesh ends where confidence falls below a limit, not at its last triangle
  /// Values at the ends of the color map; empty: what the mesh holds.
  std::optional<std::array<float, 2>> range{};
};

/// What the mesh's colors mean: `colors` from `min` to `max`, for a bar beside the picture.
struct ColorLegend {
  std::string title;  ///< "distance"
  std::string unit;   ///< "mm", or ""
  float min = 0, max = 1;
  std::vector<std::array<std::uint8_t, 3>> colors_rgb;
  std::vector<std::string> notes;  ///< "mean 0.031 mm"
};

}  // namespace gelslam
