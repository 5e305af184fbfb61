#pragma once

#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/surface/surface_estimator.hpp"

namespace gelslam::python {

/// A surface with the scale of its confidence.
struct TouchedSurface {
  SurfacePtr maps;
  double best_sigma_rad = 0;  ///< Standard deviation of a slope where the confidence is 255.
};

/// Throws Error unless the surface has this size and pitch. `name` stands for the argument in messages.
void require_pixels(const Surface& surface, const cv::Size& size, double pitch_mm, const std::string& name);

/// A sensor with its gradient model and background. Calls from several threads wait for each other.
class Sensor {
 public:
  /// Throws Error for a model or a background that cannot be used.
  Sensor(const Config& config, const std::vector<cv::Mat3b>& background);
  /// For surfaces that are measured by other software; such a sensor has no model.
  explicit Sensor(const Config& config);

  /// `name` stands for the image in messages.
  TouchedSurface estimate(const cv::Mat3b& bgr, const std::string& name);

  const Config& config() const { return config_; }
  const cv::Mat3b& background() const { return background_; }
  /// Reasons to doubt the background, as sentences.
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  cv::Mat3b fitted(const cv::Mat3b& bgr, const std::string& name) const;

  const Config config_;
  const ColorGain color_gain_;
  cv::Mat3b background_;
  std::vector<std::string> warnings_;
  double best_sigma_rad_ = 0;
  std::mutex mutex_;
  std::optional<SurfaceEstimator> estimator_;
};

}  // namespace gelslam::python
