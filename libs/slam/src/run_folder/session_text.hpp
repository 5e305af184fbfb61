#pragma once

#include <concepts>
#include <cstdint>
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

// What a session may name. Beyond it, files are forged or damaged: programs that number on, add poses or make
// lists by these numbers rely on it.
inline constexpr int kMaxKeyframeId = 1'000'000;
inline constexpr int kMaxTrial = 1'000'000;
inline constexpr std::int64_t kMaxFrame = 1'000'000'000'000;
inline constexpr double kMaxDistanceMm = 1e6;  // as in trajectories

/// A JSON object on one line whose last member, `crc32`, is that of all bytes before its comma. What is not
/// UTF-8 (of file names) is replaced.
std::string with_checksum(const Json& object);
/// Nothing when the checksum is missing or does not match.
std::optional<Json> without_damage(std::string_view line);

/// Throws Error when another version of the program has written it.
void check_session_version(int version);

/// Throws Error for anything but a number within [-most, most].
double number_from(const Json& json, double most);
std::int64_t integer_from(const Json& json, std::int64_t min, std::int64_t max);  ///< the same of integers
template <std::integral Integer>
Integer integer_from(const Json& json, Integer min, Integer max) {
  return static_cast<Integer>(integer_from(json, std::int64_t{min}, std::int64_t{max}));
}

/// 12 numbers: three rows of [R t], millimeters. Reading throws Error when it is no rigid motion, or one of
/// more than kMaxDistanceMm.
Json numbers(const Pose& pose);
Pose pose_from(const Json& json);

/// Reading throws Error for numbers that no edge has. Edges lead from an earlier keyframe to a later one.
Json json_of(const PoseGraphEdge& edge);
PoseGraphEdge edge_from(const Json& json);

std::filesystem::path surface_file(const std::filesystem::path& session, int keyframe);

}  // namespace gelslam::slam::detail
