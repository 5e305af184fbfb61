#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace gelslam::surface::detail {

inline constexpr int block_px = 4;

/// Size of the grid of 4x4-pixel blocks over an image; blocks at the right and lower border may be cut.
cv::Size block_grid(cv::Size image);

/// Mean color of each block, exact up to rounding of float.
class BlockAverager {
 public:
  void average(const cv::Mat3b& bgr, cv::Mat3f& means);

 private:
  std::vector<unsigned short> column_sums_;
};

/// Spreads a block mask (0 or 255) to pixels.
void spread_blocks(const cv::Mat1b& blocks, cv::Mat1b& pixels);

/// 255 for every block that holds a set pixel.
void gather_blocks(const cv::Mat1b& pixels, cv::Mat1b& blocks);

}  // namespace gelslam::surface::detail
