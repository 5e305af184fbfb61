#pragma once

#include <Eigen/Core>
#include <cmath>
#include <opencv2/core/types.hpp>
#include <optional>

namespace gelslam::surface::detail {

/// The pixel on which a point of the sensor frame lies; none beyond the picture.
inline std::optional<cv::Point> pixel_at(const Eigen::Vector3d& point_mm, cv::Size size,
                                         double pixel_pitch_mm) {
  const double u = point_mm.x() / pixel_pitch_mm + 0.5 * size.width - 0.5;
  const double v = point_mm.y() / pixel_pitch_mm + 0.5 * size.height - 0.5;
  if (!(u > -0.5 && v > -0.5 && u < size.width - 0.5 && v < size.height - 0.5)) return std::nullopt;
  return cv::Point(static_cast<int>(std::lround(u)), static_cast<int>(std::lround(v)));
}

/// To a height there, so that it does not lie on the object's other side.
inline bool is_close(const Eigen::Vector3d& point_mm, float height_mm) {
  constexpr double kToleranceMm = 0.5;
  return std::abs(point_mm.z() - static_cast<double>(height_mm)) < kToleranceMm;
}

}  // namespace gelslam::surface::detail
