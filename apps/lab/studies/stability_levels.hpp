#pragma once

#include <functional>
#include <string>
#include <vector>

#include "registration_problems.hpp"
#include "touch_studio.hpp"

namespace gelslam::lab {

/// Problems alike in what a chart shows along its x axis.
struct StabilityLevel {
  std::string chart;  ///< "overlap"
  double level = 0;   ///< 0.3
  ProblemSet set;
};

using LevelSink = std::function<void(const StabilityLevel&)>;

/// Charts in which the start is moved away from the truth and the surfaces stay the same.
bool is_basin(const std::string& chart);

/// Everything on simulated touches, `places` of each object. Elsewhere than in its own chart everything is
/// ordinary: overlap 0.8, full texture, the camera's own noise, clean gel, steady light, and a start 0.5 mm
/// and 4 degrees off. The chart of texture is of round objects only: a flat one without texture leaves no gel
/// untouched.
void simulated_levels(TouchStudio& studio, int places, const LevelSink& sink);

/// "missing frames": pairs of frames of the sequences in `folders`, started from the reference's pose.
void missing_frame_levels(const std::vector<std::filesystem::path>& folders, const LevelSink& sink);

}  // namespace gelslam::lab
