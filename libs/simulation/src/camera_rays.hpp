#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "gelslam/simulation/gel.hpp"

namespace gelslam::simulation::detail {

/// The camera's rays: from a point below the gel, or along z, through the lens and on to the gel.
class CameraRays {
 public:
  explicit CameraRays(const SensorGeometry& camera);

  /// Grid of the gel that the camera sees, with the camera's pixels in its middle; not smaller than the
  /// picture.
  const SensorGeometry& gel_grid() const { return gel_grid_; }

  /// Which pixel of that grid the picture's pixels show: the first point of the gel, as a surface over the
  /// grid, on each ray.
  cv::Mat2f seen_px(const cv::Mat1f& height_mm) const;

  /// Takes values on the grid where the pixels look.
  cv::Mat take(const cv::Mat& map, const cv::Mat2f& seen_px) const;

  /// Pixel of the picture, fractional, in which a point appears.
  Eigen::Vector2d image_px(const Eigen::Vector3d& point_mm) const;

 private:
  /// Rays that are those of the grid need no tracing.
  bool straight() const;

  SensorGeometry camera_, gel_grid_;
  cv::Mat2d plane_mm_;  ///< where the rays meet the plane z = 0
};

}  // namespace gelslam::simulation::detail
