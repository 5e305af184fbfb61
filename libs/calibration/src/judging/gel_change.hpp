#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace gelslam::calibration::detail {

/// Per channel; the fourth number is 0.
cv::Scalar median_color(const cv::Mat3f& colors);

/// The picture as mean colors of cells, 80 of them across: noise is small in them, and a frame takes little
/// time.
cv::Mat3f shrink_to_cells(const cv::Mat3b& bgr);
inline constexpr int kCellsAcross = 80;

/// How much each cell's color differs (norm over the channels, gray levels, smoothed over 3x3 cells),
/// without what most of the picture has in common (exposure, light).
cv::Mat1f cell_difference(const cv::Mat3f& cells, const cv::Mat3f& reference);
double largest(const cv::Mat1f& map);

inline constexpr double kMinTouchLevels = 5.0;  ///< of cells, where noise is below one
/// Connected cells above a level.
struct ChangedPiece {
  int cells = 0;
  double u_cells = 0.0, v_cells = 0.0;  ///< its middle
  double weight = 0.0;                  ///< sum of the differences
};
std::vector<ChangedPiece> changed_pieces(const cv::Mat1f& difference, double level);  ///< heaviest first

}  // namespace gelslam::calibration::detail
