#pragma once

#include <memory>
#include <opencv2/core/types.hpp>
#include <string>
#include <vector>

#include "gelslam/registration/registrar.hpp"

namespace gelslam::lab {

/// One point of the chart: a method with one setting away from its default.
struct SpeedSetting {
  std::string method;
  std::string knob;   ///< what is turned: "samples"; "default" for the settings everything else starts from
  std::string value;  ///< "500"
  cv::Size size{320, 240};
  std::shared_ptr<const Registrar> registrar;
};

/// Every setting that trades speed for accuracy, of the given methods (normalflow, icp, fpfh, filterreg).
std::vector<SpeedSetting> speed_settings(const std::vector<std::string>& methods);

}  // namespace gelslam::lab
