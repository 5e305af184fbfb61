#include "gelslam/image/color_map.hpp"
#include "gelslam/viewer/scene_style.hpp"

namespace gelslam {

std::vector<std::array<std::uint8_t, 3>> color_map_rgb(SceneColor color) {
  return color_map_rgb(color == SceneColor::distance ? ColorMap::distance
                       : color == SceneColor::height ? ColorMap::height
                                                     : ColorMap::confidence);
}

}  // namespace gelslam
