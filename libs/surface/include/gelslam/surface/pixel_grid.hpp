#pragma once

#include <Eigen/Core>
#include <cmath>
#include <opencv2/core/types.hpp>
#include <optional>

namespace gelslam {

/// Where the pixels of a picture lie on the sensor: the origin of the sensor frame is the image center, so
/// that pixel (u, v) lies at x = (u - W/2 + 1/2) * pitch, y = (v - H/2 + 1/2) * pitch. Pixels may be
/// fractions.
struct PixelGrid {
  cv::Size size;
  double pitch_mm = 0;

  /// Pixel coordinates of the sensor's origin.
  Eigen::Vector2d center_px() const { return {0.5 * size.width - 0.5, 0.5 * size.height - 0.5}; }

  template <typename Scalar>
  Eigen::Matrix<Scalar, 2, 1> to_mm(const Eigen::Matrix<Scalar, 2, 1>& px) const {
    return (px - center_px().cast<Scalar>()) * static_cast<Scalar>(pitch_mm);
  }
  Eigen::Vector2d to_mm(cv::Point pixel) const { return to_mm(Eigen::Vector2d(pixel.x, pixel.y)); }

  Eigen::Vector2d to_px(const Eigen::Vector2d& mm) const { return mm / pitch_mm + center_px(); }

  /// The pixel on which a point lies; none beyond the picture and for NaN.
  std::optional<cv::Point> pixel_at(const Eigen::Vector2d& mm) const {
    const Eigen::Vector2d px = to_px(mm);
    if (!(px.x() > -0.5 && px.y() > -0.5 && px.x() < size.width - 0.5 && px.y() < size.height - 0.5))
      return std::nullopt;
    return cv::Point(static_cast<int>(std::lround(px.x())), static_cast<int>(std::lround(px.y())));
  }
};

}  // namespace gelslam
