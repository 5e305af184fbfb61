#pragma once

#include <functional>
#include <memory>
#include <string>

#include "gelslam/localization/localizer.hpp"
#include "gelslam/slam/live_slam.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/viewer/map_window.hpp"

namespace gelslam {

/// A frame's lines, `tum` "" where it has no pose in a map, and what is to be shown of it.
struct PoseLine {
  std::string ndjson, tum;
  LiveTouch touch;
  std::string state, reason;  ///< of LiveStatus
};

/// For every frame in order.
using PoseOutput = std::function<PoseLine(const SurfaceStream::Item&)>;

/// Poses in the frame of the trial, as NDJSON.
PoseOutput trial_output(const SlamOptions& options);

/// Poses in the frame of a map, and what `touches` (or null) shows of them.
PoseOutput map_output(std::shared_ptr<const SurfaceMap> map, const SlamOptions& options,
                      LocatedTouches* touches);

}  // namespace gelslam
