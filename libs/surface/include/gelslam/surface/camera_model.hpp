#pragma once

#include <Eigen/Core>
#include <cmath>
#include <opencv2/core/types.hpp>
#include <optional>

#include "gelslam/core/sensor_optics.hpp"

namespace gelslam {

/// Maps between the pixels of a picture and points of the sensor frame. Unless raw pixels are mentioned,
/// pixels are those of the rectified grid, which is regular in the plane z = 0: the ray of pixel (u, v) meets
/// this plane at the "rest coordinates" X = ((u - W/2 + 1/2) * pitch, (v - H/2 + 1/2) * pitch) in mm. The raw
/// image of the camera has as many pixels, and without lens distortion the two are the same. Pixel
/// coordinates may be fractions. This camera is not in the papers, whose camera is orthographic.
struct CameraModel {
  cv::Size size;        ///< width and height of the picture in pixels
  double pitch_mm = 0;  ///< mm per pixel in the plane z = 0
  SensorOptics optics = {};

  bool operator==(const CameraModel&) const = default;

  /// Returns the pixel coordinates of the sensor's origin.
  Eigen::Vector2d center_px() const { return {0.5 * size.width - 0.5, 0.5 * size.height - 0.5}; }

  /// Returns the rest coordinates of a pixel.
  template <typename Scalar>
  Eigen::Matrix<Scalar, 2, 1> to_mm(const Eigen::Matrix<Scalar, 2, 1>& px) const {
    return (px - center_px().cast<Scalar>()) * static_cast<Scalar>(pitch_mm);
  }
  Eigen::Vector2d to_mm(cv::Point pixel) const { return to_mm(Eigen::Vector2d(pixel.x, pixel.y)); }
  Eigen::Vector2d to_px(const Eigen::Vector2d& rest_mm) const { return rest_mm / pitch_mm + center_px(); }

  /// Returns the point at the height z (mm, in the sensor frame) on the ray with the rest coordinates X.
  template <typename Scalar>
  Eigen::Matrix<Scalar, 3, 1> point_mm(const Eigen::Matrix<Scalar, 2, 1>& rest_mm, Scalar height_mm) const {
    const Scalar scale = 1 + height_mm * static_cast<Scalar>(optics.inverse_distance());
    return {scale * rest_mm.x(), scale * rest_mm.y(), height_mm};
  }
  Eigen::Vector3d point_mm(cv::Point pixel, double height_mm) const {
    return point_mm(to_mm(pixel), height_mm);
  }

  /// Returns the rest coordinates (mm) of the ray through a point of the sensor frame.
  template <typename Scalar>
  Eigen::Matrix<Scalar, 2, 1> project(const Eigen::Matrix<Scalar, 3, 1>& point_mm) const {
    return point_mm.template head<2>() / (1 + point_mm.z() * static_cast<Scalar>(optics.inverse_distance()));
  }

  /// Returns the pixel in which a point appears, or nothing if it is outside the picture, behind the camera,
  /// or not a number.
  std::optional<cv::Point> pixel_at(const Eigen::Vector3d& point_mm) const {
    if (!(1 + point_mm.z() * optics.inverse_distance() > 0)) return std::nullopt;
    return pixel_of(to_px(project(point_mm)));
  }
  std::optional<cv::Point> pixel_of(const Eigen::Vector2d& px) const {
    if (!(px.x() > -0.5 && px.y() > -0.5 && px.x() < size.width - 0.5 && px.y() < size.height - 0.5))
      return std::nullopt;
    return cv::Point(static_cast<int>(std::lround(px.x())), static_cast<int>(std::lround(px.y())));
  }

  // The height of the gel at rest (mm) at x and y of the sensor frame, and its gradient (dz/dx, dz/dy) there.
  double rest_height_mm(const Eigen::Vector2d& xy_mm) const {
    return -(optics.gel_dome_per_mm[0] * xy_mm.x() * xy_mm.x() +
             optics.gel_dome_per_mm[1] * xy_mm.y() * xy_mm.y());
  }
  Eigen::Vector2d rest_slope(const Eigen::Vector2d& xy_mm) const {
    return {-2 * optics.gel_dome_per_mm[0] * xy_mm.x(), -2 * optics.gel_dome_per_mm[1] * xy_mm.y()};
  }
  /// Returns the point (mm) at which the ray with the rest coordinates X meets the gel at rest.
  Eigen::Vector3d rest_point_mm(const Eigen::Vector2d& rest_mm) const {
    // The height solves z = -q (1 + z / distance)².
    const double q = -rest_height_mm(rest_mm);
    const double scale = 2 / (1 + std::sqrt(1 + 4 * q * optics.inverse_distance()));
    return {scale * rest_mm.x(), scale * rest_mm.y(), -q * scale * scale};
  }

  /// Returns w = D ln(1 + z / D) for a height z, where D is the distance of the camera; for an orthographic
  /// camera w = z. The derivatives of w by the rest coordinates depend on the slopes alone, not on the
  /// height, so w can be integrated (docs/algorithms.md).
  double relief_mm(double height_mm) const {
    const double per_mm = optics.inverse_distance();
    return per_mm > 0 ? std::log1p(height_mm * per_mm) / per_mm : height_mm;
  }
  /// Returns the inverse of relief_mm(): z = D (exp(w / D) - 1).
  double height_mm(double relief_mm) const {
    const double per_mm = optics.inverse_distance();
    return per_mm > 0 ? std::expm1(relief_mm * per_mm) / per_mm : relief_mm;
  }

  /// Returns the pixel of the raw image that shows the same ray as a pixel of the rectified grid, or nothing
  /// if the pixel is so far out that a negative k1 would map it back toward the center.
  std::optional<Eigen::Vector2d> raw_px(const Eigen::Vector2d& px) const;
  /// Returns the inverse of raw_px(): the pixel of the rectified grid that shows the ray of a raw pixel, or
  /// the nearest one if the lens maps no ray to that raw pixel.
  Eigen::Vector2d rectified_px(const Eigen::Vector2d& raw_px) const;

 private:
  Eigen::Vector2d principal_px() const {
    return center_px() + Eigen::Vector2d(optics.lens_center_px[0], optics.lens_center_px[1]);
  }
};

}  // namespace gelslam
