#include "sensor.hpp"

#include <algorithm>
#include <array>

#include "gelslam/sensor/image_input.hpp"
#include "gelslam/surface/background.hpp"
#include "gelslam/surface/slope_uncertainty.hpp"

namespace gelslam::python {

Sensor::Sensor(const Config& config, const std::vector<cv::Mat3b>& background)
    : config_(config), color_gain_(config.color_gain_bgr) {
  const GradientModel model = read_gradient_model(config.sensor.calibration_model_path);
  std::vector<cv::Mat3b> pictures;
  for (const cv::Mat3b& picture : background) pictures.push_back(fitted(picture, "background"));
  background_ = background_image(pictures);
  doubts_ = judge_background(background_, config.sensor.device_name, &model);
  const SlopeUncertainty sigma = uncertainty_of(model, background_.size(), config.surface.pixel_pitch_mm);
  best_sigma_rad_ = *std::min_element(sigma.sigma_rad.begin(), sigma.sigma_rad.end());
  estimator_.emplace(model, background_, config.surface);
}

TouchedSurface Sensor::estimate(const cv::Mat3b& bgr, const std::string& name) {
  const std::lock_guard lock(mutex_);
  return {estimator_->estimate(fitted(bgr, name)), best_sigma_rad_};
}

/// As a log's frames are: at the configuration's size and brightness.
cv::Mat3b Sensor::fitted(const cv::Mat3b& bgr, const std::string& name) const {
  cv::Mat3b picture = fit_to_profile(bgr, config_.sensor, name);
  if (config_.color_gain_bgr != std::array<double, 3>{1.0, 1.0, 1.0}) {
    if (picture.data == bgr.data) picture = picture.clone();
    color_gain_.apply(picture);
  }
  return picture;
}

}  // namespace gelslam::python
