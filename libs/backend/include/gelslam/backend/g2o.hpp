#pragma once

#include <filesystem>
#include <map>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"

namespace gelslam {

/// Writes a pose graph as a g2o file: a VERTEX_SE3:QUAT line per node, a FIX line for the smallest node of
/// each connected component, and an EDGE_SE3:QUAT line per edge. Lengths are in meters there (mm * 1e-3). g2o
/// orders an edge's error as (translation, vector part of the unit quaternion), and the vector part is half
/// the rotation vector. The 3x3 blocks of our information matrix (rotation vector in rad, translation in mm)
/// are therefore swapped and scaled: rotation by 4, translation by 1e6, the mixed blocks by 2000. Both
/// conventions define the error as measured_from_T_to^-1 * from_T_to, so it needs no change of frame. Throws
/// Error when the file cannot be written, or when an edge names a node without a pose; the file is never left
/// half written.
void write_g2o(const std::filesystem::path& path, const std::map<int, Pose>& map_T_node,
               const std::vector<PoseGraphEdge>& edges);

/// Writes EDGE_SE3:QUAT lines alone, for edges that are kept beside such a file. A user who appends them to
/// that file adds these edges to its graph.
void write_g2o_edges(const std::filesystem::path& path, const std::vector<PoseGraphEdge>& edges);

}  // namespace gelslam
