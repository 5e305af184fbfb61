#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace gelslam::calibration::detail {

/// Returns the median of each channel. The fourth number of the scalar is 0.
cv::Scalar median_color(const cv::Mat3f& colors);

/// Returns the mean colors of square cells, 80 across the image. They have little noise, and computations on
/// them are fast.
cv::Mat3f shrink_to_cells(const cv::Mat3b& bgr);
inline constexpr int kCellsAcross = 80;

/// Returns for each cell how much its color differs from the reference, in gray levels. The median difference
/// of all cells, which is a change of exposure or light, is subtracted. The differences are then averaged
/// over 3x3 cells, and the result is their norm over the channels.
cv::Mat1f cell_difference(const cv::Mat3f& cells, const cv::Mat3f& reference);
/// Returns the largest value of a map that is not empty.
double largest(const cv::Mat1f& map);

/// The least cell_difference() of a touch, in gray levels. The noise of a cell is below one gray level.
inline constexpr double kMinTouchLevels = 5.0;

/// A connected component of the cells whose difference is above a level.
struct ChangedPiece {
  int cells = 0;
  double u_cells = 0.0, v_cells = 0.0;  ///< its center, in cells
  double weight = 0.0;                  ///< the sum of the differences of its cells
};
/// Returns the connected components of cells whose difference exceeds `level`, those of the largest weight
/// first.
std::vector<ChangedPiece> changed_pieces(const cv::Mat1f& difference, double level);

}  // namespace gelslam::calibration::detail
