#pragma once

#include <functional>
#include <string>
#include <vector>

#include "registration_problems.hpp"
#include "touch_studio.hpp"

namespace gelslam::lab {

/// Problems with the same value on the x axis of a chart.
struct StabilityLevel {
  std::string chart;  ///< "overlap"
  double level = 0;   ///< 0.3
  ProblemSet set;
};

using LevelSink = std::function<void(const StabilityLevel&)>;

/// Says whether a chart varies the initial pose only, with the same surfaces.
bool is_basin(const std::string& chart);

/// Makes all charts of simulated touches, with `places` touches of each object. Except for the quantity that
/// a chart varies, everything has its ordinary value: overlap 0.8, full texture, the camera's own noise,
/// clean gel, constant light, and an initial pose 0.5 mm and 4 degrees off. The chart of texture uses round
/// objects only, because a flat object without texture leaves no gel untouched.
void simulated_levels(TouchStudio& studio, int places, const LevelSink& sink);

/// Makes the chart "missing frames": pairs of frames of the sequences in `folders`, with the pose of the
/// reference as the initial pose.
void missing_frame_levels(const std::vector<std::filesystem::path>& folders, const LevelSink& sink);

}  // namespace gelslam::lab
