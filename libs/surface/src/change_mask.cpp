#include "change_mask.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace gelslam::surface::detail {
namespace {

constexpr float min_threshold_gray_levels = 0.8F;
// The lower quartile of the averaged difference lies in the untouched gel even when most of the gel is
// touched. For a Gaussian of three channels it is 1.1 sigma; 4.5 of it (5 sigma) leaves one block in 10^4 of
// pure noise.
constexpr float quartiles_above_noise = 4.5F;
constexpr int margin_blocks = 2;

}  // namespace

void ChangeDetector::detect(const cv::Mat3f& difference, cv::Mat1b& changed_blocks) {
  cv::blur(difference, mean_, cv::Size(3, 3), cv::Point(-1, -1), cv::BORDER_REPLICATE);
  squared_.create(difference.size());
  for (int row = 0; row < mean_.rows; ++row) {
    for (int column = 0; column < mean_.cols; ++column)
      squared_(row, column) = mean_(row, column).dot(mean_(row, column));
  }
  scratch_.assign(squared_.begin(), squared_.end());
  const auto quartile = scratch_.begin() + static_cast<std::ptrdiff_t>(scratch_.size() / 4);
  std::nth_element(scratch_.begin(), quartile, scratch_.end());
  const float threshold = std::max(min_threshold_gray_levels, quartiles_above_noise * std::sqrt(*quartile));
  cv::compare(squared_, threshold * threshold, core_, cv::CMP_GT);
  constexpr int side = 2 * margin_blocks + 1;
  cv::dilate(core_, changed_blocks, cv::getStructuringElement(cv::MORPH_RECT, cv::Size(side, side)));
}

}  // namespace gelslam::surface::detail
