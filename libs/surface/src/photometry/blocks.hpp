#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace gelslam::surface::detail {

/// The side of a block in pixels. Light and changes are found on the mean colors of blocks.
inline constexpr int kBlockPx = 4;

/// Returns the numbers of columns and rows of 4x4-pixel blocks that cover an image. Blocks at the right and
/// lower border may be smaller.
cv::Size block_grid(cv::Size image);

/// Returns a block mask in which all blocks are set.
cv::Mat1b all_blocks(cv::Size image);

/// Computes the mean color of each block in gray levels (B, G, R), exact up to rounding of float. It keeps
/// its memory from picture to picture.
class BlockAverager {
 public:
  void average(const cv::Mat3b& bgr, cv::Mat3f& means);

 private:
  std::vector<unsigned short> column_sums_;
};

/// Returns the mean color of each block of a picture, like BlockAverager.
cv::Mat3f average_blocks(const cv::Mat3b& bgr);

/// Gives each pixel the value of its block (0 or 255). `pixels` has to have the size of the picture.
void spread_blocks(const cv::Mat1b& blocks, cv::Mat1b& pixels);

/// Sets `blocks` to 255 for every block with a pixel that is not 0, and to 0 for the others.
void gather_blocks(const cv::Mat1b& pixels, cv::Mat1b& blocks);

/// Finds where a picture differs from the background by more than noise. A shallow slope changes the colors
/// of neighboring pixels in the same direction (by about 1.5 gray levels for a slope of 0.01), but noise does
/// not. Therefore the *signed* color difference is averaged over 3x3 blocks (12x12 pixels), and the norm of
/// that mean is compared with a threshold that is estimated from the noise of the frame. The result is
/// dilated by two blocks, over which slopes fade out.
class ChangeDetector {
 public:
  /// `difference`: the block means of the picture, converted to the background's light, minus those of the
  /// background. Sets `changed_blocks` to 255 where the picture has changed, else to 0.
  void detect(const cv::Mat3f& difference, cv::Mat1b& changed_blocks);

 private:
  float threshold_levels();

  cv::Mat3f mean_;
  cv::Mat1f squared_;
  std::vector<float> scratch_;
  cv::Mat1b core_;
};

}  // namespace gelslam::surface::detail
