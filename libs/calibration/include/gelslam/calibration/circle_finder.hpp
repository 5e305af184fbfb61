#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "gelslam/calibration/press_set.hpp"
#include "gelslam/surface/camera_model.hpp"

namespace gelslam {

/// The circle of a press, found in the picture itself.
struct FoundCircle {
  ContactCircle circle;     ///< about the ball's center
  double confidence = 0.0;  ///< 0 to 1: share of the color change around the contact that the ball explains
  std::string problem;      ///< for people: why it should not be used; empty when it is good
  bool second_contact = false;  ///< something touches the gel beside this contact
};

/// Finds the contact circle by fitting a press to the picture (own): the relative color change is a
/// quadratic function of the slope, common to the whole contact, and the slope is that of a ball of
/// `diameter_mm` inside the contact and dies away exponentially outside. Center, radius and decay are fitted
/// by robust least squares with the color function eliminated (variable projection), sub-pixel, and again
/// with one of degree 4, which follows shadows. Parts outside the picture are not needed. Both images of one
/// size; the circle is that of the picture, whatever the camera's optics. Never throws on a picture: without
/// contact `problem` says so.
FoundCircle find_circle(const cv::Mat3b& bgr, const cv::Mat3b& background, const CameraModel& camera,
                        double diameter_mm);

/// Contacts are found with a ball this many times as large, whose slopes limit no width.
inline constexpr double kFlatterBall = 4.0;

/// Length of the camera's raw pixels at some place over those of the rectified grid: less than 1 where the
/// lens magnifies.
double rest_px_per_raw_px(const CameraModel& camera, const Eigen::Vector2d& raw_px);

}  // namespace gelslam
