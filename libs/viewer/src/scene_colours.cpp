#include "scene_colours.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace gelslam::viewer::detail {
namespace {

using Eigen::Vector3f;

float smooth_step(float from, float to, float x) {
  const float t = std::clamp((x - from) / (to - from), 0.0F, 1.0F);
  return t * t * (3 - 2 * t);
}

/// Linear light from direction n of the ball: a large soft window, a low warm one, a dark floor and a bright
/// rim.
Vector3f reflection(const Vector3f& n) {
  const Vector3f window = Vector3f(-0.5F, 0.6F, 0.62F).normalized(),
                 lamp = Vector3f(0.75F, -0.25F, 0.6F).normalized();
  const float sky = smooth_step(-0.9F, 0.9F, n.y());
  Vector3f light = (1 - sky) * Vector3f(0.035F, 0.04F, 0.05F) + sky * Vector3f(0.20F, 0.23F, 0.27F);
  light += std::max(n.dot(window), 0.0F) * Vector3f(0.32F, 0.30F, 0.27F);
  light += smooth_step(0.80F, 0.99F, n.dot(window)) * Vector3f(0.50F, 0.49F, 0.46F);
  light += smooth_step(0.75F, 0.98F, n.dot(lamp)) * Vector3f(0.17F, 0.11F, 0.06F);
  return light + std::pow(1 - n.z(), 4.0F) * Vector3f(0.16F, 0.20F, 0.26F);
}

std::uint8_t encode(float linear) {
  return static_cast<std::uint8_t>(std::lround(255 * std::pow(std::clamp(linear, 0.0F, 1.0F), 1 / 2.2F)));
}

}  // namespace

std::vector<std::array<std::uint8_t, 3>> colour_map_rgb(SceneColour colour) {
  cv::Mat1b levels(1, 256);
  for (int i = 0; i < 256; ++i) {
    // the dark ends of the maps would look like shadow
    levels(i) =
        static_cast<std::uint8_t>(colour == SceneColour::distance ? 252 - i * 200 / 255 : 20 + i * 228 / 255);
  }
  cv::Mat3b bgr;
  cv::applyColorMap(levels, bgr,
                    colour == SceneColour::distance   ? cv::COLORMAP_MAGMA
                    : colour == SceneColour::keyframe ? cv::COLORMAP_TURBO
                                                      : cv::COLORMAP_VIRIDIS);
  std::vector<std::array<std::uint8_t, 3>> rgb;
  for (const cv::Vec3b& c : bgr) rgb.push_back({c[2], c[1], c[0]});
  return rgb;
}

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

}  // namespace gelslam::viewer::detail
