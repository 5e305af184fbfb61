#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/surface/gradient_model.hpp"
#include "photometry/light.hpp"

namespace gelslam::surface::detail {

/// Bare gel is read flatter than this: 0.01 to 0.06 as the median over all pixels (another sensor's model
/// reads 0.24 or more), 0.08 at its steepest places (the shallowest ball press 0.14).
inline constexpr double kBareSlope = 0.105;

/// Turns slope angles to slopes, in place: tan with a relative error below 1e-6; angles are limited to 1.5
/// rad.
void tangents(NetworkTile::Values<2>& angles_rad);

/// Computes the gradient of the gel's height over a whole image, relative to the background image. In a block
/// of 4x4 pixels of nearly the same color the network is evaluated once, with its derivatives: it is linear
/// but for the few ReLUs that switch within the block.
class GradientMap {
 public:
  GradientMap(const GradientModel& model, const cv::Mat3b& background);

  /// Writes gx, gy (HxW, height per distance) in the blocks set in `blocks` (block_grid()), and zero
  /// elsewhere. All images have the background's size; `colors` brings them into the background's light. The
  /// result in a block does not depend on which others are set.
  void compute(const cv::Mat3b& bgr, const ColorTable& colors, const cv::Mat1b& blocks, cv::Mat1f& gx,
               cv::Mat1f& gy);

  /// Returns what the model says about the background itself: a bias that is smooth if nothing touches there.
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
  std::array<float, 3> to_unit_{1 / 255.0F, 1 / 255.0F, 1 / 255.0F};  // of gray levels, for the network
  std::vector<float> column_, row_;                                   // u/W, v/H
  cv::Mat1f background_gx_, background_gy_;
  cv::Mat1f gx_, gy_;                        // the result of compute()
  std::vector<cv::Point> smooth_, rough_;    // first pixels of smooth blocks; pixels of all others
  std::vector<unsigned char> least_, most_;  // values of a row of blocks, by column
  std::vector<float> colors_of_blocks_;      // of a tile of smooth blocks, corrected: block, channel, pixel
  NetworkTile tile_;
  NetworkJacobian jacobian_;
  alignas(64) NetworkTile::Values<2> angles_{};
  std::array<int, kNetworkTile> pixels_{};  // where the angles belong
};

}  // namespace gelslam::surface::detail
