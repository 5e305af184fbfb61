#pragma once

#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/slam/slam_map.hpp"

namespace gelslam::slam::detail {

/// A frame between two keyframes was registered to the first of them with the same error of the slopes that
/// the link from it to the second has, in proportion to how much of that motion it has made: what corrected
/// surfaces put right about the link is shared out among the frames. `measured`: links as tracked,
/// `corrected`: the same registered again; other edges do not count, and frames after the last link stay as
/// they are. Source: own.
void share_out_corrections(const std::vector<PoseGraphEdge>& measured,
                           const std::vector<PoseGraphEdge>& corrected, std::vector<FrameRecord>& frames);

}  // namespace gelslam::slam::detail
