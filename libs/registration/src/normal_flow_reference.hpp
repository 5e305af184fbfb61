#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/registration/normal_flow.hpp"
#include "normal_flow_kernels.hpp"

namespace gelslam {

struct NormalFlowReference::Impl {
  SurfacePtr surface;
  registration::detail::Samples samples;
  std::vector<float> curvature;  ///< Surface::curvature of each sample, for SCR and CCS
  SelfSimilarityPtr self_similarity;
};

struct SelfSimilarity {
  std::once_flag once;
  double value = 0;
};

namespace registration::detail {

/// Returns how the target's camera sees the reference at this pose. The center about which rx and ry rotate
/// is the weighted center of the samples, with the weights of the residuals.
Viewpoint viewpoint_of(const TargetView& target, const Pose& target_T_reference, const Samples& samples,
                       const Residuals& residuals);

/// The derivative of the normal by x and by y, per pixel, from Sobel filters. The pixel must not be at the
/// border of the picture.
struct NormalGradient {
  cv::Vec3f dx, dy;
};

inline NormalGradient normal_gradient(const cv::Mat3f& normals, cv::Point p) {
  const cv::Vec3f *above = &normals(p.y - 1, p.x), *here = &normals(p), *below = &normals(p.y + 1, p.x);
  return {(above[1] - above[-1] + 2.0f * (here[1] - here[-1]) + below[1] - below[-1]) * 0.125f,
          (below[-1] - above[-1] + 2.0f * (below[0] - above[0]) + below[1] - above[1]) * 0.125f};
}

TargetView view_of(const Surface& target);

/// Finds the target pixel that is nearest to a warped sample. A sample beyond the picture gets a pixel of its
/// border; such a sample has no weight.
class PixelLookup {
 public:
  PixelLookup(const Samples& samples, const Surface& target, const Pose& target_T_reference)
      : samples_(samples),
        rotation_(target_T_reference.linear().cast<float>()),
        translation_(target_T_reference.translation().cast<float>()),
        target_(view_of(target)) {}

  Eigen::Vector3f warped_mm(std::size_t k) const {
    return rotation_ * Eigen::Vector3f(samples_.x[k], samples_.y[k], samples_.z[k]) + translation_;
  }
  cv::Point pixel(const Eigen::Vector3f& p) const {
    const float shrink = 1.0f / (1.0f + p.z() * target_.inverse_distance);
    return {std::clamp(cvRound(p.x() * shrink * target_.inverse_pitch_per_mm + target_.center_u_px), 0,
                       target_.width - 1),
            std::clamp(cvRound(p.y() * shrink * target_.inverse_pitch_per_mm + target_.center_v_px), 0,
                       target_.height - 1)};
  }

  const Eigen::Matrix3f& rotation() const { return rotation_; }
  float inverse_pitch_per_mm() const { return target_.inverse_pitch_per_mm; }

 private:
  const Samples& samples_;
  Eigen::Matrix3f rotation_;
  Eigen::Vector3f translation_;
  TargetView target_;
};

}  // namespace registration::detail

}  // namespace gelslam
