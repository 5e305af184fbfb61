#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "gelslam/frontend/tracker.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// Where a frame lies in the map of all trials.
struct MapPlace {
  Pose map_T_frame = Pose::Identity();
  int component = 0;
};

/// What is said of one frame to other programs.
struct FrameReport {
  const TrackedFrame& tracked;
  const Surface* surface = nullptr;      ///< null for a frame of the background
  std::optional<double> arrived_s{};     ///< Unix time
  std::optional<Matrix6d> covariance{};  ///< TrialDrift
  std::optional<MapPlace> place{};
  int scan = 0;
};

/// The fields of docs/streaming.md.
nlohmann::ordered_json frame_json(const FrameReport& report);
/// The same as one line, with its end.
std::string ndjson_line(const FrameReport& report);

/// 16 numbers, row by row, meters.
std::array<double, 16> row_major_meters(const Pose& pose_mm);
/// Fields `sigma_mm` and `sigma_deg`; null when it is not known.
void add_sigma(nlohmann::ordered_json& json, const std::optional<Matrix6d>& covariance);

}  // namespace gelslam
