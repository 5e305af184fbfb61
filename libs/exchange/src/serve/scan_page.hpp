#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "gelslam/slam/live_slam.hpp"
#include "gelslam/slam/mesh_feed.hpp"

namespace gelslam::exchange::detail {

/// Returns the status as text and numbers.
nlohmann::ordered_json status_json(const LiveStatus& status);

/// Returns outlines of the contact in the map (mm) and in the image (relative to its size). Null without
/// contact; if the pose in the map is not known, the outlines in the map are left out.
nlohmann::ordered_json touch_json(const FrameReport& touch, const MapSnapshot* map);

/// Returns the path of the sensor over the shown map: how many keyframes have the same pose as in `known`
/// (may be null), and all following ones with their trial and position (mm).
nlohmann::ordered_json path_json(const MapSnapshot& map, const MapSnapshot* known);

/// Encodes an answer for the page, little-endian: size of the JSON (4 bytes), JSON, and blocks. Each block
/// has positions (3 float), normals (3 int16, times 32767), weights (int16, times 32767/128), and triangles
/// (3 int).
std::string encode_changes(nlohmann::ordered_json json, const MeshFeed::Changes& changes);

}  // namespace gelslam::exchange::detail
