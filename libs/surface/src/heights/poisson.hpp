#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// The heights of squares in pixels, integrated along each row of a picture by itself, and along each column
/// by itself. Each row or column begins with 0. Where the gradient field has curl, the two disagree.
struct LineHeights {
  cv::Mat1f along_rows, along_columns;
};

/// Integrates a gradient field to heights by least squares: it solves the Poisson equation with Neumann
/// (free) boundary conditions, exactly and without iterations. poisson.cpp describes the method. A gradient
/// field without curl is reproduced exactly, up to a constant.
class PoissonSolver {
 public:
  explicit PoissonSolver(cv::Size size);

  /// Solves for the heights. `gx`, `gy`: the gradient (HxW, dimensionless). Returns the mean heights of
  /// squares of 2x2 pixels, ceil(H/2) x ceil(W/2), in pixels and up to a constant. The result is a view of a
  /// work buffer and valid until the next call.
  cv::Mat1f solve(const cv::Mat1f& gx, const cv::Mat1f& gy);

  /// Returns the heights of the squares that follow from the gradient of the last solve() if each row, or
  /// each column, is integrated by itself.
  LineHeights line_heights() const;

  /// Returns the heights of the pixels (HxW), multiplied by `scale`: with the pixel pitch in mm, the result
  /// is in mm. `squares`: the result of solve(), to which a smooth correction may have been added. The
  /// gradient given to solve() must not have changed since.
  cv::Mat1f pixels(const cv::Mat1f& squares, float scale = 1.0F);

 private:
  void solve_columns();

  cv::Size size_, grid_;        // the numbers of pixels and of squares
  cv::Mat1f pivot_;             // inverse pivots of the tridiagonal systems, one column per frequency
  cv::Mat1f gx_, gy_;           // the gradient of the last solve()
  cv::Mat1f steps_, solution_;  // the height differences of the squares, and their heights
  cv::Mat1f relaxed_;           // pixel heights after one step of relaxation
};

}  // namespace gelslam::surface::detail
