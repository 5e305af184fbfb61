#pragma once

#include <algorithm>
#include <cmath>

#include "gelslam/core/se3.hpp"
#include "gelslam/surface/surface.hpp"
#include "normal_flow_kernels.hpp"

namespace gelslam::registration::detail {

/// Nearest target pixel of a warped sample, the border's where it lies beyond. Samples with weight lie
/// inside.
class PixelLookup {
 public:
  PixelLookup(const Samples& samples, const Surface& target, const Pose& target_T_reference)
      : samples_(samples),
        rotation_(target_T_reference.linear().cast<float>()),
        translation_(target_T_reference.translation().cast<float>()),
        inverse_pitch_(static_cast<float>(1.0 / target.pixel_pitch_mm)),
        center_u_(static_cast<float>(target.contact.cols) * 0.5f - 0.5f),
        center_v_(static_cast<float>(target.contact.rows) * 0.5f - 0.5f),
        size_(target.contact.size()) {}

  Eigen::Vector3f warped_mm(std::size_t k) const {
    return rotation_ * Eigen::Vector3f(samples_.x[k], samples_.y[k], samples_.z[k]) + translation_;
  }
  cv::Point pixel(const Eigen::Vector3f& p) const {
    return {
        std::clamp(static_cast<int>(std::lround(p.x() * inverse_pitch_ + center_u_)), 0, size_.width - 1),
        std::clamp(static_cast<int>(std::lround(p.y() * inverse_pitch_ + center_v_)), 0, size_.height - 1)};
  }

  const Eigen::Matrix3f& rotation() const { return rotation_; }

 private:
  const Samples& samples_;
  Eigen::Matrix3f rotation_;
  Eigen::Vector3f translation_;
  float inverse_pitch_, center_u_, center_v_;
  cv::Size size_;
};

}  // namespace gelslam::registration::detail
