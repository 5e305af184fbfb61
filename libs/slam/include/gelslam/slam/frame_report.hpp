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

/// A pose where the sensor may be.
struct PlaceHypothesis {
  UncertainPose map_T_sensor;
  /// The remainder to 1, over all hypotheses, is the probability that the sensor is elsewhere or not on the
  /// mapped object.
  double probability = 0;
};

enum class PlaceStatus { unknown, localized, ambiguous };

/// The result of localizing a frame in a known map.
struct Localization {
  PlaceStatus status = PlaceStatus::unknown;
  /// The most probable first; only one when localized, none when unknown.
  std::vector<PlaceHypothesis> hypotheses{};
  std::string reason{};  ///< Reason why the pose is not certain, for the user.
};

/// Everything that is reported about one frame to windows, web pages, streams and Python: the measurement and
/// the resulting poses. A FrameRecord is the part of it that a scan stores.
struct FrameReport {
  TrackedFrame tracked{};
  cv::Mat3b image{};                   ///< Image of the sensor at the profile's resolution.
  SurfacePtr surface{};                ///< null for a frame of the background
  std::optional<MapPlace> in_trial{};  ///< Pose in its trial; empty if the frame was not tracked.
  /// Pose in the growing map, or in the map in which the sensor is localized. For a lost frame that begins a
  /// trial, it is the pose of the trial's first keyframe.
  std::optional<MapPlace> in_map{};
  std::optional<Localization> localization{};  ///< Set by a Localizer.
  std::string warning{};  ///< Sentence about motions that have not been observable for some time; or "".

  /// True if something touches the sensor.
  bool has_contact() const {
    return tracked.status == TrackStatus::tracked || tracked.status == TrackStatus::lost;
  }
  /// Returns `in_map` for a frame that was tracked or localized, and null for others.
  const MapPlace* known_place() const {
    return in_map && (tracked.status == TrackStatus::tracked || localization) ? &*in_map : nullptr;
  }
};

/// Returns the frame as a line of NDJSON, with the line end (docs/streaming.md). `scan` is the number of the
/// scan since the program started.
std::string ndjson_line(const FrameReport& report, int scan = 0);
/// Returns the frame's pose in the map as a line of TUM format, with the line end, or "" if it is not known.
std::string tum_line(const FrameReport& report);

/// Returns the field `status` of the stream: the name of the TrackStatus, or, for a frame with contact and a
/// Localizer, "localized", "ambiguous" or "not in the map".
std::string_view status_name(const FrameReport& report);
/// The field `reason`: why a frame is lost, or its pose uncertain.
std::string reason_of(const FrameReport& report);
/// Returns the time of capture by the system's clock as Unix time in seconds; null if it is not known.
nlohmann::ordered_json unix_s(std::int64_t unix_us);
/// Returns the 4x4 matrix of a pose row by row, with the translation in meters.
std::array<double, 16> row_major_meters(const Pose& pose_mm);

}  // namespace gelslam
