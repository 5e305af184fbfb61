#pragma once

#include <memory>
#include <opencv2/imgproc.hpp>

#include "gelslam/surface/surface.hpp"

namespace gelslam::test {

/// A flat round touch of 2 mm radius, `depth_mm` deep.
inline SurfacePtr round_touch(double depth_mm = 0.3) {
  auto surface = std::make_shared<Surface>();
  const cv::Size size(160, 120);
  surface->pixel_pitch_mm = 0.06;
  surface->height_mm = cv::Mat1f::zeros(size);
  surface->normals = cv::Mat3f(size, cv::Vec3f(0, 0, 1));
  surface->contact = cv::Mat1b::zeros(size);
  surface->curvature = cv::Mat1f::zeros(size);
  cv::circle(surface->contact, {80, 60}, 33, 255, cv::FILLED);
  surface->height_mm.setTo(-depth_mm, surface->contact);
  surface->contact_pixels = cv::countNonZero(surface->contact);
  return surface;
}

}  // namespace gelslam::test
