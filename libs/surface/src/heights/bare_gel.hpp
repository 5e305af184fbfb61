#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/surface/camera_model.hpp"
#include "heights/poisson.hpp"

namespace gelslam::surface::detail {

/// Removes the errors of integrated heights, for which it uses that bare gel has the height 0. This step is
/// not in the papers.
///
/// Input: the heights h from PoissonSolver, whose constant of integration is unknown, and a mask of the gel
/// whose color has not changed. Such gel is bare, so what the integration gives there is the accumulated
/// error of the slopes. A smooth correction d is added to the heights, which minimizes
///     sum over neighboring cells a, b of (d_a - d_b)² / (variance of the height difference between a and b)
///   + sum over bare cells a of (h_a + d_a)² / (variance of the height of bare gel).
/// The correction therefore changes most where the slopes are least certain. The cells are 8 pixels wide, and
/// the normal equations are solved exactly by a banded Cholesky decomposition.
///
/// Gel that a flat face presses down has the color of bare gel, too. A connected region of unchanged gel is
/// therefore taken for pressed if it lies below the highest gel by more than the errors of the slopes
/// explain. If a region seems pressed, the heights of the cells are integrated again, with variances that
/// grow with the squared slope, and these heights decide. That integration relies on the flat gel around a
/// contact rather than on its steep flanks, where the errors are larger. A region that was bare in the frame
/// before has to lie lower than another one to be taken for pressed (hysteresis).
class BareGelLeveler {
 public:
  /// `confidence`: the map from confidence_map(), or empty if slopes have the same variance everywhere.
  /// `slope_noise_ratio`, `slope_sigma_ratio`: the members of Surface with these names.
  explicit BareGelLeveler(const CameraModel& camera, const cv::Mat1b& confidence = {},
                          double slope_noise_ratio = 1, double slope_sigma_ratio = 1);

  struct Result {
    /// True if there is enough bare gel. Otherwise the object covers the whole picture, and the heights are
    /// only shifted so that their 99th percentile is 0.
    bool seen = false;
    float scatter_px = 0.0F;  ///< standard deviation of the heights of bare gel, in pixels
  };
  /// Corrects `height_px` in place. It holds what PoissonSolver::solve() returned: the heights of 2x2-pixel
  /// squares in pixels. `changed`: a mask of blocks (see block_grid()), 0 where the picture has not changed;
  /// `slopes`: the solver that returned the heights.
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
