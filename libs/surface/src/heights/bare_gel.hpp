#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/surface/camera_model.hpp"
#include "heights/poisson.hpp"

namespace gelslam::surface::detail {

/// Makes integrated heights relative to the bare gel. This step is not in the papers. Gel whose color has not
/// changed has the height 0, so its integrated height is the accumulated error of the slopes. A smooth
/// correction d removes it. It minimizes
///     sum over neighboring cells (d_a - d_b)² / variance of the slope between them
///   + sum over bare cells (h_a + d_a)² / variance of the height of bare gel,
/// so that the correction changes most where slopes are least certain. Cells are 8 pixels wide, and the
/// equations are solved exactly by banded Cholesky decomposition.
///
/// The gel under a flat face has the color of bare gel, too. It lies below the highest gel by more than the
/// errors of slopes explain, so a connected region of unchanged gel that lies so low is not bare. A region
/// that was bare in the last frame has to lie lower than another one to lose this state (hysteresis). For
/// this question heights are integrated once more, on cells, with slope variances that grow with the slope.
/// The integration then follows flat gel around a contact instead of its flanks, whose errors are larger.
class BareGelLeveler {
 public:
  /// `confidence`: confidence_map(); empty: slopes have the same variance everywhere.
  /// `slope_noise_ratio`, `slope_sigma_ratio`: those of Surface.
  explicit BareGelLeveler(const CameraModel& camera, const cv::Mat1b& confidence = {},
                          double slope_noise_ratio = 1, double slope_sigma_ratio = 1);

  struct Result {
    /// There is enough bare gel. Otherwise the object covers the picture, and the highest cells get the
    /// height 0.
    bool seen = false;
    float scatter_px = 0.0F;  ///< standard deviation of the heights of bare gel, in pixels
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
  cv::Mat1f changed_variance_;  // variance of the slopes of each cell if its color has changed
  cv::Mat1f height_;            // the uncorrected height of each cell, divided by slope_noise_ratio
  cv::Mat1b were_bare_;         // the cells that were bare in the frame before
  cv::Mat1b bare_;              // the cells that are bare
  cv::Mat1i labels_;
  cv::Mat1f fine_;
  std::vector<float> band_, right_side_, scratch_;
};

}  // namespace gelslam::surface::detail
