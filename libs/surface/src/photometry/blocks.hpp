#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace gelslam::surface::detail {

inline constexpr int kBlockPx = 4;

/// Returns the size of the grid of 4x4-pixel blocks over an image; blocks at the right and lower border may
/// be cut.
cv::Size block_grid(cv::Size image);

/// Returns a block mask in which all blocks are set.
cv::Mat1b all_blocks(cv::Size image);

/// Computes the mean color of each block, exact up to rounding of float.
class BlockAverager {
 public:
  void average(const cv::Mat3b& bgr, cv::Mat3f& means);

 private:
  std::vector<unsigned short> column_sums_;
};

/// Does the same for a single picture.
cv::Mat3f average_blocks(const cv::Mat3b& bgr);

/// Spreads a block mask (0 or 255) to pixels.
void spread_blocks(const cv::Mat1b& blocks, cv::Mat1b& pixels);

/// Sets 255 for every block that holds a set pixel.
void gather_blocks(const cv::Mat1b& pixels, cv::Mat1b& blocks);

/// Finds where a picture differs from the background by more than noise. A shallow slope shifts the color of
/// many neighbors in one direction (by about 1.5 gray levels for a slope of 0.01), white noise does not: so
/// the *signed* difference is averaged over 3x3 blocks (12x12 pixels) before its length is compared with a
/// threshold, which follows the frame's own noise. The result is grown by a margin in which slopes fade out.
class ChangeDetector {
 public:
  /// `difference`: block means of image minus background in the background's light. Fills changed_blocks, 255
  /// or 0.
  void detect(const cv::Mat3f& difference, cv::Mat1b& changed_blocks);

 private:
  float threshold_levels();

  cv::Mat3f mean_;
  cv::Mat1f squared_;
  std::vector<float> scratch_;
  cv::Mat1b core_;
};

}  // namespace gelslam::surface::detail
