#include "label/label_picture.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "gelslam/calibration/press_change.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double gray = 128.0, reach = 120.0, smooth_px = 0.8;
constexpr double most_of_it = 0.99, least_levels = 6.0;  // noise is not stretched to full contrast

double quantile(std::vector<float> values, double share) {
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return static_cast<double>(*place);
}

}  // namespace

cv::Mat3b difference_picture(const cv::Mat3b& bgr, const cv::Mat3b& background) {
  cv::Mat3f change = press_change(bgr, background);
  cv::GaussianBlur(change, change, cv::Size(), smooth_px);
  std::vector<float> sizes;
  for (const cv::Vec3f& c : change)
    for (int channel = 0; channel < 3; ++channel) sizes.push_back(std::abs(c[channel]));
  cv::Mat3b picture;
  change.convertTo(picture, CV_8U, reach / std::max(least_levels, quantile(sizes, most_of_it)), gray);
  return picture;
}

}  // namespace gelslam::viewer::detail
