#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace gelslam::calibration::detail {

/// Returns the median per channel; the fourth number is 0.
cv::Scalar median_color(const cv::Mat3f& colors);

/// Returns the mean colors of square cells, 80 across the image. They have little noise, and computations on
/// them are fast.
cv::Mat3f shrink_to_cells(const cv::Mat3b& bgr);
inline constexpr int kCellsAcross = 80;

/// Returns for each cell how much its color differs from the reference (norm over the channels in gray
/// levels, smoothed over 3x3 cells), after subtracting the median difference, which is a change of exposure
/// or light.
cv::Mat1f cell_difference(const cv::Mat3f& cells, const cv::Mat3f& reference);
double largest(const cv::Mat1f& map);

inline constexpr double kMinTouchLevels = 5.0;  ///< In gray levels; the noise of a cell is below one.
/// A connected component of cells above a level.
struct ChangedPiece {
  int cells = 0;
  double u_cells = 0.0, v_cells = 0.0;  ///< Its center.
  double weight = 0.0;                  ///< Sum of the differences.
};
/// Sorted by weight, largest first.
std::vector<ChangedPiece> changed_pieces(const cv::Mat1f& difference, double level);

}  // namespace gelslam::calibration::detail
