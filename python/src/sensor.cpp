#include "sensor.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "bind.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "gelslam/surface/background.hpp"
#include "gelslam/surface/background_drift.hpp"
#include "gelslam/surface/model_file.hpp"
#include "gelslam/surface/slopes.hpp"

namespace gelslam::python {

void require_pixels(const Surface& surface, const cv::Size& size, double pitch_mm, const std::string& name) {
  if (surface.height_mm.size() == size && surface.pixel_pitch_mm == pitch_mm) return;
  throw Error(fmt::format("{}: is of another sensor: {}x{} pixels of {} mm, not {}x{} of {} mm", name,
                          surface.height_mm.cols, surface.height_mm.rows, surface.pixel_pitch_mm, size.width,
                          size.height, pitch_mm));
}

Sensor::Sensor(const Config& config, const std::vector<cv::Mat3b>& background)
    : config_(config), color_gain_(config.color_gain_bgr) {
  const GradientModel model = read_gradient_model(config.sensor.calibration_model_path);
  std::vector<cv::Mat3b> pictures;
  for (const cv::Mat3b& picture : background) pictures.push_back(fitted(picture, "background"));
  background_ = background_image(pictures);
  warnings_ = judge_background(background_, config.sensor.device_name, &model, config.surface.pixel_pitch_mm);
  if (const BackgroundCheck check = check_background(pictures, model, config.surface); check.contact)
    warnings_.push_back("the background should show the bare gel, but " + check.reason);
  const SlopeUncertainty sigma = uncertainty_of(model, background_.size(), config.surface.pixel_pitch_mm);
  best_sigma_rad_ = *std::min_element(sigma.sigma_rad.begin(), sigma.sigma_rad.end());
  estimator_.emplace(model, background_, config.surface);
}

Sensor::Sensor(const Config& config)
    : config_(config),
      color_gain_(config.color_gain_bgr),
      background_(cv::Mat3b::zeros(config.sensor.height_px, config.sensor.width_px)) {}

TouchedSurface Sensor::estimate(const cv::Mat3b& bgr, const std::string& name) {
  if (!estimator_) throw Error(name + ": this sensor has no model: give surfaces");
  const cv::Mat3b picture = fitted(bgr, name);
  constexpr double kSameLightLevels = 4.0;  // Presses in the background's light differ by at most 2.
  if (!config_.surface.compensate_light &&
      measure_drift(background_cells(background_), background_cells(picture)).light_change_levels >
          kSameLightLevels) {
    const WithGil acquire;
    warn(name + ": the gel has not the background's light, which is not followed: the surface is wrong");
  }
  const std::lock_guard lock(mutex_);
  return {estimator_->estimate(picture), best_sigma_rad_};
}

/// Brings an image to the size and brightness of the configuration, as for a log's frames.
cv::Mat3b Sensor::fitted(const cv::Mat3b& bgr, const std::string& name) const {
  cv::Mat3b picture = fit_to_profile(bgr, config_.sensor, name);
  if (config_.color_gain_bgr != std::array<double, 3>{1.0, 1.0, 1.0}) {
    if (picture.data == bgr.data) picture = picture.clone();
    color_gain_.apply(picture);
  }
  return picture;
}

}  // namespace gelslam::python
