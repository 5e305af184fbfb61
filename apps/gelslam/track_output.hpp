#pragma once

#include <functional>
#include <memory>

#include "gelslam/localization/localizer.hpp"
#include "gelslam/slam/surface_stream.hpp"

namespace gelslam {

/// What is known of a frame; to be called for every frame in order. Its `in_map` is its pose in the output.
using FrameLocator = std::function<FrameReport(const SurfaceStream::Item&)>;

/// Poses in the frame of the trial.
FrameLocator locate_in_trials(const SlamOptions& options);

/// Poses in the frame of a map.
FrameLocator locate_in_map(std::shared_ptr<const SurfaceMap> map, const SlamOptions& options);

}  // namespace gelslam
