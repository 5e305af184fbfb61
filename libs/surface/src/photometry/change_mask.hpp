#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace gelslam::surface::detail {

/// Where an image differs from the background by more than noise. A shallow slope shifts the color of many
/// neighbors in one direction (about 1.5 gray levels for 0.01), white noise does not: so the *signed*
/// difference is averaged over 3x3 blocks (12x12 pixels) before its length is compared with a threshold,
/// which follows the frame's own noise (and not a texture that covers the whole gel). The result is grown by
/// a margin in which slopes fade out.
class ChangeDetector {
 public:
  /// `difference`: block means of image minus background in the background's light. Fills changed_blocks, 255
  /// or 0.
  void detect(const cv::Mat3f& difference, cv::Mat1b& changed_blocks);

 private:
  float noise_unless_textured();

  cv::Mat3f mean_, fine_;
  cv::Mat1f squared_, fine_squared_;
  std::vector<float> scratch_;
  cv::Mat1b core_;
  bool was_textured_ = false;
};

}  // namespace gelslam::surface::detail
