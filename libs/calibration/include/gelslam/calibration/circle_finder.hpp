#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "gelslam/calibration/press_set.hpp"
#include "gelslam/surface/camera_model.hpp"

namespace gelslam {

/// The contact circle of a press, found in the image.
struct FoundCircle {
  ContactCircle circle;  ///< Contact circle around the ball's center.
  /// Fraction of the color change around the contact that the ball explains, 0 to 1.
  double confidence = 0.0;
  std::string problem;  ///< Sentence for the user why the circle should not be used; empty when it is good.
  bool second_contact = false;  ///< True if something touches the gel beside this contact.
};

/// Finds the contact circle by fitting a model of a press to the image (not in the paper). The relative color
/// change is modeled as a quadratic function of the slope, the same for the whole contact. The slope is that
/// of a ball of `diameter_mm` inside the contact, and decays exponentially outside. Center, radius and decay
/// length are fitted by robust least squares with sub-pixel accuracy; the coefficients of the color function
/// are eliminated (variable projection). The fit is repeated with a color function of degree 4, which can
/// follow shadows. The contact may extend beyond the image. Both images must have the same size. The circle
/// is in pixels of the image, whatever the camera's optics. Does not throw for any image content: if there is
/// no contact, `problem` says so.
FoundCircle find_circle(const cv::Mat3b& bgr, const cv::Mat3b& background, const CameraModel& camera,
                        double diameter_mm);

/// To detect contacts, a ball this many times as large is assumed, whose slopes do not limit the contact's
/// width.
inline constexpr double kFlatterBall = 4.0;

/// Returns the width of a raw camera pixel at a place, in pixels of the rectified grid; less than 1 where the
/// lens magnifies.
double rest_px_per_raw_px(const CameraModel& camera, const Eigen::Vector2d& raw_px);

}  // namespace gelslam
