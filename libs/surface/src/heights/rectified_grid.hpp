#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/surface/camera_model.hpp"

namespace gelslam::surface::detail {

/// Resamples maps of the camera's raw image on the rectified grid, which is regular in the plane z = 0 of the
/// sensor frame, so that the distortion of the lens is removed. If CameraModel has no lens, the maps are
/// returned unchanged. Pixels that lie outside the raw image get the value at its border.
class RectifiedGrid {
 public:
  explicit RectifiedGrid(const CameraModel& camera);

  /// Resamples a map from the raw image to the rectified grid, by bilinear interpolation.
  cv::Mat1f resample(const cv::Mat1f& raw) const;
  cv::Mat1b resample(const cv::Mat1b& raw) const;
  /// Resamples a mask of blocks (0 or 255) to the rectified grid. A block is set if the interpolated value is
  /// at least one half, so that regions keep their size. (If they grew, less bare gel would remain as
  /// reference of the heights.)
  cv::Mat1b resample_mask(const cv::Mat1b& raw_blocks) const;
  /// Resamples a mask of blocks from the rectified grid to the raw image.
  cv::Mat1b raw_mask(const cv::Mat1b& rectified_blocks) const;

  /// Sets the pixels of a rectified mask to 0 that lie outside the raw image.
  void remove_beyond(cv::Mat1b& rectified) const;

  /// For every pixel of the resampled map, row by row: the four pixels of the source between which it lies.
  struct Places {
    std::vector<std::int32_t> first;  // the index of the upper left one, in a map without padding
    std::vector<float> right, below;  // the distances from it in pixels, 0 to 1
  };

 private:
  Places to_rectified_, blocks_to_rectified_, blocks_to_raw_;  // empty without a lens
  cv::Mat1b beyond_;
};

}  // namespace gelslam::surface::detail
