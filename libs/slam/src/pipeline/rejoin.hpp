#pragma once

#include <memory>
#include <vector>

#include "gelslam/loop_closure/loop_closer.hpp"
#include "gelslam/slam/slam_map.hpp"

namespace gelslam::slam::detail {

/// Where track was lost from one frame to the next without contact being lost, the object has moved by no
/// more than a frame's worth: the new trial's first keyframe is laid upon the keyframes before it from there,
/// and verified as any loop. It finds fragments that are too small for recognition. Surfaces that look like
/// themselves, or that fit at several places, prove no place here either. Null keyframes are passed over.
std::vector<LoopConstraint> rejoin_broken_trials(
    const std::vector<std::shared_ptr<const Keyframe>>& keyframes, const std::vector<FrameRecord>& frames,
    const LoopCloser& loop_closer, const LoopClosureOptions& options);

}  // namespace gelslam::slam::detail
