#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <utility>

#include "gelslam/frontend/tracker.hpp"
#include "gelslam/slam/line_feed.hpp"
#include "gelslam/slam/map_snapshot.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// What is sent of one frame to other programs.
struct FrameReport {
  const TrackedFrame& tracked;
  const Surface* surface = nullptr;    ///< null for a frame of the background
  std::optional<MapPlace> in_trial{};  ///< none where it was not tracked
  std::optional<MapPlace> in_map{};    ///< none where it was not tracked or is not in the map
  int scan = 0;
  cv::Mat3b picture{};  ///< what the sensor saw; shared, not copied
};

/// The fields of docs/streaming.md.
nlohmann::ordered_json frame_json(const FrameReport& report);
/// The same as one line, with its end.
std::string ndjson_line(const FrameReport& report);

/// When it was captured, by the system's clock; null when it is not known.
nlohmann::ordered_json unix_s(std::int64_t unix_us);
/// 16 numbers, row by row, meters.
std::array<double, 16> row_major_meters(const Pose& pose_mm);
/// Fields `sigma_mm` and `sigma_deg`; null where there is no covariance.
void add_sigma(nlohmann::ordered_json& json, const std::optional<Matrix6d>& covariance);

/// Poses of a live scan for other programs, as soon as they are known.
class PoseStream {
 public:
  /// The tracking thread: every frame, in order. Does not wait.
  void write(FrameReport report, const MapSnapshot& map);
  /// Frames that follow belong to another scan.
  void start_scan();
  /// Any thread: the map has changed.
  void write_map(std::shared_ptr<const MapSnapshot> map) { feed_.set_map(std::move(map), scan_); }

  LineFeed& feed() { return feed_; }

 private:
  LineFeed feed_;
  int scan_ = 0;
};

}  // namespace gelslam
