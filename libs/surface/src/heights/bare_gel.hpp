#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/surface/camera_model.hpp"
#include "heights/poisson.hpp"

namespace gelslam::surface::detail {

/// Lays integrated heights upon the bare gel (own). Gel whose picture shows no change lies at height 0, so
/// what integration yields there is the sum of the errors of slopes along the way. A smooth correction d
/// takes it off:
///   minimize  sum over neighboring cells (d_a - d_b)² / variance of the slope between them
///           + sum over bare cells (h_a + d_a)² / variance of a bare height,
/// so that errors are spread where slopes are least certain. Cells are 8 pixels wide, the equations are
/// solved exactly. A flat face that touches has the color of bare gel, too, but lies below the highest gel by
/// more than errors of slopes explain: such pieces of unchanged gel are not bare, and stay so or bare unless
/// the heights say otherwise clearly (hysteresis). Errors grow with slopes, so
/// heights are integrated again for this question, on cells, where slopes are small rather than steep: around
/// a contact whose flanks contradict each other instead of across it.
class BareGelLeveler {
 public:
  /// `confidence`: confidence_map(); empty: slopes are known equally well everywhere;
  /// `slope_noise_ratio`, `slope_sigma_ratio`: Surface's.
  explicit BareGelLeveler(const CameraModel& camera, const cv::Mat1b& confidence = {},
                          double slope_noise_ratio = 1, double slope_sigma_ratio = 1);

  struct Result {
    bool seen = false;  ///< enough bare gel; else the object covers the whole, and the highest cells lie at 0
    float scatter_px = 0.0F;  ///< of the bare gel's heights, about 0
  };
  /// `height_px` (as PoissonSolver::solve() returns it) in place; `changed`: a block mask (block_grid()), 0
  /// where the picture shows no change; `slopes`: what has solved for the heights.
  Result level(cv::Mat1f& height_px, const cv::Mat1b& changed, const PoissonSolver& slopes);

 private:
  void mark_unchanged(const cv::Mat1b& changed);
  bool remove_pressed(const cv::Mat1f& heights);
  void shrink_to_cells(const cv::Mat1f& squares, cv::Mat1f& cells);
  float highest_of(const cv::Mat1f& heights);
  cv::Mat1f integrate_where_flat(const LineHeights& lines);
  cv::Mat1f solve(const LineHeights& steps, const cv::Mat1f& variance, float bare_weight,
                  const cv::Mat1f& bare_height);
  void add_correction(cv::Mat1f& height_px);

  cv::Size grid_;
  float noise_, slope_error_;
  float bare_height_px_, min_fall_px_, slope_patch_px_;
  cv::Mat1f changed_variance_;  // of slopes in cells that changed
  cv::Mat1f height_;            // of the cells, as given, over the noise
  cv::Mat1b were_bare_;         // cells, in the frame before
  cv::Mat1b bare_;              // cells
  cv::Mat1i labels_;
  cv::Mat1f fine_;
  std::vector<float> band_, right_side_, scratch_;
};

}  // namespace gelslam::surface::detail
