#include "contact_mask.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace gelslam::surface::detail {
namespace {

cv::Mat square(int size_px) { return cv::getStructuringElement(cv::MORPH_RECT, cv::Size(size_px, size_px)); }

float order_statistic(std::vector<float>& values, double fraction) {
  const auto rank = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

}  // namespace

float untouched_level(const cv::Mat1f& height, const cv::Mat1b& changed, std::vector<float>& scratch) {
  scratch.clear();
  for (int v = 0; v < height.rows; ++v) {
    for (int u = 0; u < height.cols; ++u) {
      if (changed(v, u) == 0) scratch.push_back(height(v, u));
    }
  }
  if (scratch.size() * 20 >= height.total()) return order_statistic(scratch, 0.5);
  scratch.clear();
  for (int v = 0; v < height.rows; ++v) scratch.insert(scratch.end(), height[v], height[v] + height.cols);
  return order_statistic(scratch, 0.85);
}

ContactDetector::ContactDetector(cv::Size size, const ContactRule& rule)
    : rule_(rule), grow_(square(7)), shrink_(square(15)), border_(square(2 * (size.height / 48) + 1)) {}

void ContactDetector::detect(const cv::Mat3b& bgr, const cv::Mat3b& background, const ColorTable& colors,
                             const cv::Mat1f& height_mm, cv::Mat1b& contact) {
  const auto squared_threshold = static_cast<float>(rule_.color_dist_threshold * rule_.color_dist_threshold);
  colored_.create(height_mm.size());
  for (int v = 0; v < bgr.rows; ++v) {
    const unsigned char* now = bgr[v]->val;
    const unsigned char* then = background[v]->val;
    unsigned char* out = colored_[v];
    for (int u = 0; u < bgr.cols; ++u, now += 3, then += 3) {
      const float b = colors[0][now[0]] - static_cast<float>(then[0]);
      const float g = colors[1][now[1]] - static_cast<float>(then[1]);
      const float r = colors[2][now[2]] - static_cast<float>(then[2]);
      out[u] = b * b + g * g + r * r > squared_threshold ? 255 : 0;
    }
  }
  cv::dilate(colored_, scratch_, grow_);
  cv::erode(scratch_, colored_, shrink_);
  cv::compare(height_mm, -rule_.height_threshold_mm, scratch_, cv::CMP_LT);
  cv::bitwise_and(colored_, scratch_, scratch_);
  cv::erode(scratch_, contact, border_);
}

}  // namespace gelslam::surface::detail
