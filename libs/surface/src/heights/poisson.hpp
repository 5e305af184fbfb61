#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// The heights of squares along the lines of a picture, in pixels; each line has its own zero. Where
/// gradients contradict each other, lines disagree.
struct LineHeights {
  cv::Mat1f along_rows, along_columns;
};

/// Finds the least-squares height from gradients, with Neumann (free) borders. Unknowns are the mean heights
/// of squares of four pixels. Edge gradient between two pixels = mean of theirs; difference between two
/// squares = sum of the edge gradients between their middles. The discrete Poisson equation of these
/// differences is solved exactly, by the cosine transform along rows and a tridiagonal system per frequency
/// along columns. A consistent gradient field comes back exactly, up to a constant.
class PoissonSolver {
 public:
  explicit PoissonSolver(cv::Size size);

  /// Solves for the heights. gx, gy: HxW, height difference per pixel step. Returns the heights of the
  /// squares, ceil(H/2) x ceil(W/2), in pixels and up to a constant (a view of the work buffer, valid until
  /// the next call).
  cv::Mat1f solve(const cv::Mat1f& gx, const cv::Mat1f& gy);

  /// Returns what the gradients of the last solve say of the squares' heights along each row (column) by
  /// itself, from 0 at its first square.
  LineHeights line_heights() const;

  /// Returns the heights of the pixels, HxW, in units of 1/`scale` pixels. `squares`: what solve() returned;
  /// smooth heights may have been added. The gradients given to solve() must still be there.
  cv::Mat1f pixels(const cv::Mat1f& squares, float scale = 1.0F);

 private:
  void solve_columns();

  cv::Size size_, grid_;        // grid_: of squares
  cv::Mat1f pivot_;             // inverse pivots of the tridiagonal systems, one column per frequency
  cv::Mat1f gx_, gy_;           // of the last solve
  cv::Mat1f steps_, solution_;  // steps_: between squares
  cv::Mat1f relaxed_;           // pixel heights after one step of relaxation
};

}  // namespace gelslam::surface::detail
