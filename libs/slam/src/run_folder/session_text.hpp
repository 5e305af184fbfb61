#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/slam/session.hpp"

namespace gelslam::slam::detail {

using Json = nlohmann::ordered_json;

inline constexpr int kSessionVersion = 2;

/// A JSON object on one line whose last member, `crc32`, is that of all bytes before its comma. What is not
/// UTF-8 (of file names) is replaced.
std::string with_checksum(const Json& object);
/// Nothing when the checksum is missing or does not match.
std::optional<Json> without_damage(std::string_view line);

/// Throws Error when a newer version of the program has written it.
void check_session_version(int version);

/// 12 numbers: three rows of [R t], millimeters. Reading throws Error when it is no rigid motion.
Json numbers(const Pose& pose);
Pose pose_from(const Json& json);

/// Reading throws Error for numbers that are not finite.
Json json_of(const PoseGraphEdge& edge);
PoseGraphEdge edge_from(const Json& json);

std::filesystem::path surface_file(const std::filesystem::path& session, int keyframe);
/// With its slopes corrected.
std::filesystem::path corrected_file(const std::filesystem::path& session, int keyframe);

/// A session of version 1 (up to gelslam 0.2): the map's patches, each as a TIFF of four planes. Throws Error
/// and JSON exceptions.
Session load_session_v1(const std::filesystem::path& folder, const Json& json);

}  // namespace gelslam::slam::detail
