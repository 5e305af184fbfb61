#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/surface/gradient_model.hpp"
#include "photometry/light.hpp"

namespace gelslam::surface::detail {

/// The largest slope that a model of the same sensor reads on bare gel. The median over all pixels is 0.01 to
/// 0.06, and 0.08 is the largest value (presses of balls have 0.14 or more). With a model of another sensor
/// the median is 0.24 or more.
inline constexpr double kBareSlope = 0.105;

/// Replaces slope angles (rad) by their tangents, with a relative error below 1e-6. Angles are limited to 1.5
/// rad.
void tangents(NetworkTile::Values<2>& angles_rad);

/// Computes the gradient of the height of the gel over a picture: the tangents of the two slope angles that
/// the gradient model reads from the color and the position of each pixel, minus those that it reads at the
/// same pixel of the background (NormalFlow, §III). If the colors of a 4x4-pixel block are nearly equal, the
/// network is evaluated once for the block and extrapolated to its pixels with its derivatives. The error is
/// small, because few ReLUs switch within such a block. This shortcut is not in the papers.
class GradientMap {
 public:
  GradientMap(const GradientModel& model, const cv::Mat3b& background);

  /// Computes `gx`, `gy` (HxW, dimensionless) in the blocks that are set in `blocks` (see block_grid()), and
  /// sets them to zero elsewhere. `bgr` has the size of the background; `colors` converts its gray levels to
  /// the background's light. The result in a block does not depend on which other blocks are set.
  void compute(const cv::Mat3b& bgr, const ColorTable& colors, const cv::Mat1b& blocks, cv::Mat1f& gx,
               cv::Mat1f& gy);

  /// Returns the gradient that the model reads in the background (HxW, dimensionless). Where nothing touches
  /// the gel, it is the smooth error of the model.
  const cv::Mat1f& background_gx() const { return background_gx_; }
  const cv::Mat1f& background_gy() const { return background_gy_; }
  /// Returns Surface::slope_noise_ratio.
  double slope_noise_ratio() const { return slope_noise_ratio_; }

 private:
  void sort_blocks(const cv::Mat3b& bgr, const cv::Mat1b& blocks);
  int color_range(int left) const;
  void run_smooth(const cv::Mat3b& bgr, const ColorTable& colors);
  void run_rough(const cv::Mat3b& bgr, const ColorTable& colors);
  void write_blocks(const cv::Point* corners, std::size_t blocks);
  void write_slopes(int count);
  void to_slopes();
  double slope_per_level(const cv::Mat3b& background);
  void fill_features(std::size_t i, const cv::Mat3b& bgr, const cv::Point& pixel, const ColorTable& colors);

  FrozenNetwork network_;
  std::array<float, 4> slope_matrix_;
  double slope_noise_ratio_ = 0;
  std::array<float, 3> to_unit_{1 / 255.0F, 1 / 255.0F, 1 / 255.0F};  // gray levels to the network's input
  std::vector<float> column_, row_;                                   // u/W, v/H
  cv::Mat1f background_gx_, background_gy_;
  cv::Mat1f gx_, gy_;                        // the result of compute()
  std::vector<cv::Point> smooth_, rough_;    // first pixels of smooth blocks; pixels of the others
  std::vector<unsigned char> least_, most_;  // per column and channel, in a row of blocks
  std::vector<float> colors_of_blocks_;      // the network's input for a tile: [block][channel][pixel]
  NetworkTile tile_;
  NetworkJacobian jacobian_;
  alignas(64) NetworkTile::Values<2> angles_{};
  std::array<int, kNetworkTile> pixels_{};  // the indices of the pixels in the tile
};

}  // namespace gelslam::surface::detail
