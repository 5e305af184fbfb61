#pragma once

#include <opencv2/core/mat.hpp>

#include "gelslam/surface/camera_model.hpp"

namespace gelslam::surface::detail {

/// Takes maps of the raw picture to the rest grid, where the lens has no effect; without a lens they stay as
/// they are. Beyond the picture its border continues.
class RestGrid {
 public:
  explicit RestGrid(const CameraModel& camera);

  /// Linear between pixels.
  cv::Mat resample(const cv::Mat& raw) const;
  /// The same for means of blocks (block_grid()).
  cv::Mat resample_blocks(const cv::Mat& raw) const;
  /// Masks of blocks: set where any of the blocks on which one falls is.
  cv::Mat1b resample_mask(const cv::Mat1b& raw_blocks) const;
  /// And back.
  cv::Mat1b raw_mask(const cv::Mat1b& rest_blocks) const;

  /// Sets zero what lies beyond the raw picture.
  void remove_beyond(cv::Mat1b& rest) const;

 private:
  struct Way {
    cv::Mat at, between;  // as cv::remap takes them
  };
  Way to_rest_, blocks_to_rest_, blocks_to_raw_;  // none without a lens
  cv::Mat1b beyond_;
};

}  // namespace gelslam::surface::detail
