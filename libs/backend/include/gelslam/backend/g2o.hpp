#pragma once

#include <filesystem>
#include <map>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"

namespace gelslam {

/// Writes VERTEX_SE3:QUAT, FIX (smallest node of each component) and EDGE_SE3:QUAT lines, in meters (mm *
/// 1e-3). g2o's edge error is (translation, vector part of the unit quaternion), and that vector part is half
/// the rotation vector: so the blocks of the information change places, rotation weighs 4 times and
/// translation 1e6 times as much, the mixed blocks 2000 times. Both error conventions are
/// measured_from_T_to^-1 * from_T_to, so no frame changes. Throws Error when the file cannot be written;
/// never leaves half a file under `path`.
void write_g2o(const std::filesystem::path& path, const std::map<int, Pose>& map_T_node,
               const std::vector<PoseGraphEdge>& edges);

/// EDGE_SE3:QUAT lines alone, to be kept beside such a file: appended to it, they are part of its graph.
void write_g2o_edges(const std::filesystem::path& path, const std::vector<PoseGraphEdge>& edges);

}  // namespace gelslam
