#include "gelslam/surface/rim_weight.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace gelslam {

cv::Mat1f rim_weight(const cv::Mat1b& contact) {
  const float rim_px = static_cast<float>(contact.rows) / 60.0F;  // as published
  cv::Mat1f weight;
  cv::distanceTransform(contact, weight, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  for (float& at : weight) at = at > 0 ? 0.5F * (std::tanh(at / rim_px - 1.0F) + 1.0F) : 0.0F;
  return weight;
}

}  // namespace gelslam
