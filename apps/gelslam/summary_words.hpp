#pragma once

#include <string>

#include "gelslam/slam/reconstruct.hpp"

namespace gelslam {

/// "120 frames in the map; 1 trial in 1 piece, 6 keyframes, 1 loop".
std::string map_words(const ReconstructSummary& summary);
/// "mesh of 12146 vertices and 23394 triangles".
std::string mesh_words(const ReconstructSummary& summary);

}  // namespace gelslam
