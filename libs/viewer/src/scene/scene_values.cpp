#include "scene/scene_values.hpp"

#include <algorithm>
#include <cmath>

#include "gelslam/core/median.hpp"

namespace gelslam::viewer::detail {
float round_limit_mm(std::vector<float> distance_mm) {
  std::erase_if(distance_mm, [](float d) { return !std::isfinite(d) || d < 0; });
  if (distance_mm.empty()) return 1;
  const float wanted = std::max(quantile_in_place(distance_mm, 0.98), 1e-4F);
  const float power = std::pow(10.0F, std::floor(std::log10(wanted)));
  for (const float step : {1.0F, 2.0F, 5.0F}) {
    if (step * power >= wanted) return step * power;
  }
  return 10 * power;
}

cv::Mat4b doubt_by_keyframe(const MapSnapshot& map, double from_mm, double to_mm) {
  const int last = map.nodes.empty() ? 0 : map.nodes.back().keyframe;
  cv::Mat4b doubt(1 + last / kDoubtColumns, kDoubtColumns, cv::Vec4b(0, 0, 0, 255));
  double sigma_mm = 0;  // of a keyframe that is not known yet: that of the one before
  for (const MapSnapshot::Node& node : map.nodes) {
    if (node.component != map.shown_component) continue;
    if (node.sigma_mm >= 0) sigma_mm = node.sigma_mm;
    doubt(node.keyframe / kDoubtColumns, node.keyframe % kDoubtColumns)[0] =
        cv::saturate_cast<uchar>(255 * (2 * sigma_mm - from_mm) / (to_mm - from_mm));
  }
  return doubt;
}

}  // namespace gelslam::viewer::detail
