#include "gelslam/image/color_map.hpp"

#include <opencv2/imgproc.hpp>

namespace gelslam {

std::vector<std::array<std::uint8_t, 3>> color_map_rgb(ColorMap map) {
  const bool is_distance = map == ColorMap::distance;
  cv::Mat1b levels(1, 256);
  // The dark ends of the maps are left out, as they would look like shadow.
  for (int i = 0; i < 256; ++i)
    levels(i) = static_cast<std::uint8_t>(is_distance ? 252 - i * 200 / 255 : 20 + i * 228 / 255);
  cv::Mat3b bgr;
  cv::applyColorMap(levels, bgr,
                    is_distance               ? cv::COLORMAP_MAGMA
                    : map == ColorMap::height ? cv::COLORMAP_CIVIDIS
                                              : cv::COLORMAP_VIRIDIS);
  std::vector<std::array<std::uint8_t, 3>> rgb;
  for (const cv::Vec3b& c : bgr) rgb.push_back({c[2], c[1], c[0]});
  return rgb;
}

}  // namespace gelslam
