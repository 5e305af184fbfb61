#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/surface/camera_model.hpp"

namespace gelslam::surface::detail {

/// Resamples maps of the raw image on the rectified grid, where the lens has no effect. Without a lens the
/// maps stay as they are. Pixels outside the raw image take the value of its border.
class RectifiedGrid {
 public:
  explicit RectifiedGrid(const CameraModel& camera);

  /// Resamples linearly between pixels.
  cv::Mat1f resample(const cv::Mat1f& raw) const;
  cv::Mat1b resample(const cv::Mat1b& raw) const;
  /// Resamples a mask of blocks: a block is set where half of what falls on a block is, so that they keep
  /// their size. (Masks that grow leave less bare gel to level by.)
  cv::Mat1b resample_mask(const cv::Mat1b& raw_blocks) const;
  /// Takes a mask of blocks back to the raw image.
  cv::Mat1b raw_mask(const cv::Mat1b& rectified_blocks) const;

  /// Sets zero what lies beyond the raw image.
  void remove_beyond(cv::Mat1b& rectified) const;

  /// For every pixel of a map, row by row: the four pixels of the other map between which it lies.
  struct Places {
    std::vector<std::int32_t> first;  // of the upper left one, in a map without padding
    std::vector<float> right, below;  // how far from it, 0..1
  };

 private:
  Places to_rectified_, blocks_to_rectified_, blocks_to_raw_;  // none without a lens
  cv::Mat1b beyond_;
};

}  // namespace gelslam::surface::detail
