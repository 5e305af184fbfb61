#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "gelslam/core/gradient_model.hpp"
#include "gelslam/surface/surface_estimator.hpp"

namespace gelslam {

/// Mean of images of one size, rounded to the nearest gray level. Throws Error when there are none or sizes
/// differ.
cv::Mat3b mean_image(const std::vector<cv::Mat3b>& images);

/// Mean of pictures of the bare gel, each brought to the brightness of the last, per channel, where they
/// differ by more than a hundredth: a camera's exposure may still settle in the first of them. Throws like
/// mean_image.
cv::Mat3b background_image(const std::vector<cv::Mat3b>& frames);

struct BackgroundCheck {
  bool contact = false;
  bool markers = false;  ///< on the gel: no slopes can be read, touched or not
  std::string reason;    ///< for people; empty when there is neither
};

/// Says whether would-be background frames already show contact (own): something moves between the frames, or
/// the gel has markers (find_marker_dots), or the model reads an imprint (bent or steep locally, where the
/// bare gel shows at most a smooth bias) in their background_image. A flat object that does not move at all
/// cannot be told from bare gel. Throws Error like mean_image, and when the model does not fit.
BackgroundCheck check_background(const std::vector<cv::Mat3b>& frames, const GradientModel& model,
                                 const SurfaceOptions& options);

}  // namespace gelslam
