#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gelslam/frontend/tracker.hpp"
#include "gelslam/slam/map_snapshot.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// A place where the sensor may be.
struct PlaceHypothesis {
  UncertainPose map_T_sensor;
  double probability = 0;  ///< the rest to 1, over all hypotheses: elsewhere, or not in the map
};

enum class PlaceStatus { unknown, localized, ambiguous };

/// What a Localizer knows of a frame's place in its map.
struct Localization {
  PlaceStatus status = PlaceStatus::unknown;
  /// The most probable first; only one when localized, none when unknown.
  std::vector<PlaceHypothesis> hypotheses{};
  std::string reason{};  ///< why there is no certain place, for people
};

/// Everything that windows, pages, streams and Python are told of one frame: what was measured, and where
/// that puts the sensor. FrameRecord is what a scan keeps of it.
struct FrameReport {
  TrackedFrame tracked{};
  cv::Mat3b image{};                   ///< what the sensor saw, at the profile's resolution
  SurfacePtr surface{};                ///< null for a frame of the background
  std::optional<MapPlace> in_trial{};  ///< none where it was not tracked
  /// In the map that grows, or the one that the sensor is localized in. Of a lost frame that begins a trial
  /// it is where its keyframe is.
  std::optional<MapPlace> in_map{};
  std::optional<Localization> localization{};  ///< of a Localizer
  std::string warning{};                       ///< what has not been observable for a while, in words; or ""

  /// Something touches the sensor.
  bool has_contact() const {
    return tracked.status == TrackStatus::tracked || tracked.status == TrackStatus::lost;
  }
  /// `in_map` of a frame that was tracked or localized; else null.
  const MapPlace* known_place() const {
    return in_map && (tracked.status == TrackStatus::tracked || localization) ? &*in_map : nullptr;
  }
};

/// A line of NDJSON, with its end (docs/streaming.md). `scan` counts those of one program.
std::string ndjson_line(const FrameReport& report, int scan = 0);
/// A line of TUM, with its end; "" where the place in the map is not known.
std::string tum_line(const FrameReport& report);

/// The field `status`: TrackStatus, or of a frame with contact and a Localizer "localized", "ambiguous" or
/// "not in the map".
std::string_view status_name(const FrameReport& report);
/// The field `reason`: why a frame is lost, or its pose uncertain.
std::string reason_of(const FrameReport& report);
/// When it was captured, by the system's clock; null when it is not known.
nlohmann::ordered_json unix_s(std::int64_t unix_us);
/// 16 numbers, row by row, meters.
std::array<double, 16> row_major_meters(const Pose& pose_mm);

}  // namespace gelslam
