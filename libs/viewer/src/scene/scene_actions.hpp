#pragma once

#include <algorithm>
#include <vector>

#include "gelslam/viewer/scene_style.hpp"

namespace gelslam::viewer::detail {

/// What the windows that show a scene have in common: changes its look if `action` (WindowAction, ViewAction)
/// asks for nothing else. False for any other action.
template <typename Action>
bool change_look(SceneStyle& style, Action action) {
  switch (action) {
    case Action::shading_lit:
      style.shading = SceneShading::lit;
      return true;
    case Action::shading_matcap:
      style.shading = SceneShading::matcap;
      return true;
    case Action::shading_curvature:
      style.shading = SceneShading::curvature;
      return true;
    case Action::trajectory:
      style.trajectory = !style.trajectory;
      return true;
    case Action::pose_graph:
      style.edges = style.keyframes = !style.edges;
      return true;
    case Action::grid:
      style.grid = !style.grid;
      return true;
    default:
      return false;
  }
}

/// The one after `color`; the first after the last, and after one that is not among them.
inline SceneColor color_after(SceneColor color, const std::vector<SceneColor>& among) {
  const auto found = std::find(among.begin(), among.end(), color);
  return found == among.end() || found + 1 == among.end() ? among.front() : *(found + 1);
}

}  // namespace gelslam::viewer::detail
