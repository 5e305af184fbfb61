#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "gelslam/slam/live_slam.hpp"
#include "gelslam/slam/mesh_feed.hpp"

namespace gelslam::exchange::detail {

/// What happens in words and figures.
nlohmann::ordered_json status_json(const LiveStatus& status);

/// Where the sensor is and what it touches: outlines in the map (mm), and in the picture (shares of its
/// sides). Null without contact; without a place there are none in the map.
nlohmann::ordered_json touch_json(const FrameReport& touch, const MapSnapshot* map);

/// The way of the sensor over the shown map: how many keyframes are where `known` (may be null) has them, and
/// those that follow, each as its trial and its place (mm).
nlohmann::ordered_json path_json(const MapSnapshot& map, const MapSnapshot* known);

/// For the page: the size of the JSON (4 bytes), JSON, and blocks, each as positions (3 float), normals (3
/// int16, times 32767) and weights (int16, times 32767/128), and triangles (3 int). Little-endian.
std::string encode_changes(nlohmann::ordered_json json, const MeshFeed::Changes& changes);

}  // namespace gelslam::exchange::detail
