#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "gelslam/image/color_map.hpp"
#include "scene/scene_shaders.hpp"

namespace gelslam {
namespace viewer::detail {
namespace {

using Eigen::Vector3f;

float smooth_step(float from, float to, float x) {
  const float t = std::clamp((x - from) / (to - from), 0.0F, 1.0F);
  return t * t * (3 - 2 * t);
}

/// Linear light from direction n of the ball. What is touched mostly faces the viewer, so light changes most
/// around the middle: a soft window up left, its dark edge, warm light from the right, cold rim.
Vector3f reflection(const Vector3f& n) {
  const Vector3f window = Vector3f(-0.42F, 0.50F, 0.75F).normalized(),
                 lamp = Vector3f(0.72F, -0.38F, 0.58F).normalized();
  const float sky = smooth_step(-0.8F, 0.9F, n.y());
  Vector3f light = (1 - sky) * Vector3f(0.030F, 0.030F, 0.034F) + sky * Vector3f(0.13F, 0.15F, 0.18F);
  light += smooth_step(0.35F, 1.0F, n.dot(window)) * Vector3f(0.46F, 0.45F, 0.43F);
  light += smooth_step(0.90F, 0.985F, n.dot(window)) * Vector3f(0.34F, 0.34F, 0.33F);
  light += smooth_step(0.55F, 1.0F, n.dot(lamp)) * Vector3f(0.33F, 0.22F, 0.13F);
  return light + std::pow(1 - n.z(), 3.0F) * Vector3f(0.20F, 0.26F, 0.34F);
}

std::uint8_t encode(float linear) {
  return static_cast<std::uint8_t>(std::lround(255 * std::pow(std::clamp(linear, 0.0F, 1.0F), 1 / 2.2F)));
}

}  // namespace

}  // namespace viewer::detail

std::vector<std::array<std::uint8_t, 3>> color_map_rgb(SceneColor color) {
  return color_map_rgb(color == SceneColor::distance   ? ColorMap::distance
                       : color == SceneColor::keyframe ? ColorMap::keyframe
                       : color == SceneColor::height   ? ColorMap::height
                                                       : ColorMap::confidence);
}

namespace viewer::detail {

std::vector<std::uint8_t> make_matcap(int side_px) {
  std::vector<std::uint8_t> rgba;
  rgba.reserve(static_cast<std::size_t>(side_px) * static_cast<std::size_t>(side_px) * 4);
  for (int v = 0; v < side_px; ++v) {
    for (int u = 0; u < side_px; ++u) {
      Vector3f n(2 * (static_cast<float>(u) + 0.5F) / static_cast<float>(side_px) - 1,
                 2 * (static_cast<float>(v) + 0.5F) / static_cast<float>(side_px) - 1, 0);
      if (n.norm() > 0.999F) n *= 0.999F / n.norm();
      n.z() = std::sqrt(1 - n.squaredNorm());
      const Vector3f light = reflection(n);
      for (const float c : light) rgba.push_back(encode(c));
      rgba.push_back(255);
    }
  }
  return rgba;
}

}  // namespace viewer::detail
}  // namespace gelslam
