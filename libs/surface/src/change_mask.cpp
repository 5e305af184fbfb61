#include "change_mask.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace gelslam::surface::detail {
namespace {
constexpr int box_px = 5;
}

ChangeDetector::ChangeDetector(const cv::Mat3b& background, double threshold_gray_levels, int margin_px)
    : kernel_(cv::getStructuringElement(cv::MORPH_RECT, cv::Size(2 * margin_px + 1, 2 * margin_px + 1))) {
  background.convertTo(background_, CV_16S);
  const double of_sum = threshold_gray_levels * box_px * box_px;
  squared_threshold_of_sum_ = static_cast<int>(std::lround(of_sum * of_sum));
}

void ChangeDetector::detect(const cv::Mat3b& bgr) {
  cv::subtract(bgr, background_, difference_, cv::noArray(), CV_16S);
  cv::boxFilter(difference_, sum_, CV_16S, cv::Size(box_px, box_px), cv::Point(-1, -1), false, cv::BORDER_REPLICATE);
  core_.create(bgr.size());
  for (int v = 0; v < bgr.rows; ++v) {
    const short* sum = sum_[v]->val;
    unsigned char* out = core_[v];
    for (int u = 0; u < bgr.cols; ++u) {
      const int b = sum[3 * u], g = sum[3 * u + 1], r = sum[3 * u + 2];
      out[u] = b * b + g * g + r * r > squared_threshold_of_sum_ ? 255 : 0;
    }
  }
  cv::dilate(core_, changed_, kernel_);
}

}  // namespace gelslam::surface::detail
