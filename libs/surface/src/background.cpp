#include "gelslam/surface/background.hpp"

#include <opencv2/imgproc.hpp>

#include "gelslam/core/error.hpp"

namespace gelslam {

cv::Mat3b mean_image(const std::vector<cv::Mat3b>& images) {
  if (images.empty()) throw Error("no background images: need at least one frame without contact");
  cv::Mat3d sum(images.front().size(), cv::Vec3d::all(0.0));
  for (const cv::Mat3b& image : images) {
    if (image.size() != sum.size()) throw Error("background images differ in size");
    cv::accumulate(image, sum);
  }
  cv::Mat3b mean;
  sum.convertTo(mean, CV_8U, 1.0 / static_cast<double>(images.size()));
  return mean;
}

}  // namespace gelslam
