#pragma once

#include <filesystem>
#include <vector>

#include "gelslam/fusion/fusion.hpp"
#include "gelslam/slam/gel_slam.hpp"

namespace gelslam {

/// What is needed to fuse a map again or to relocalize in it: every keyframe's surface and pose.
struct Session {
  double gradient_scale = 1.0;
  std::vector<PosedSurface> patches;  ///< keyframes of the map, in the anchor's frame, by id
};

/// Writes the map's keyframes into a new folder: session.json and, per keyframe, its contact's bounding box
/// as <id>.tiff (32-bit float: nx, ny, height_mm, curvature). Throws Error when the disk is full.
void save_session(const std::filesystem::path& folder, const SlamMap& map);

/// Reads it back. Normals and heights outside the contact's bounding box are those of untouched gel. Throws
/// Error on missing, truncated or contradicting files.
Session load_session(const std::filesystem::path& folder);

}  // namespace gelslam
