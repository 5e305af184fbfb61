#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "gelslam/core/run_report.hpp"
#include "gelslam/frontend/tracker.hpp"
#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/slam/map_snapshot.hpp"
#include "gelslam/slam/mesh_feed.hpp"
#include "gelslam/slam/slam_map.hpp"

namespace gelslam {

enum class LivePhase { background, scanning, paused, finishing, finished };

/// The state of a scan for the user, in words and figures. Cheap to copy.
struct LiveStatus {
  LivePhase phase = LivePhase::background;
  /// For the color of `words`. `lost` lasts until what is touched now has been joined to the shown map.
  TrackStatus track = TrackStatus::no_contact;
  /// "tracking"; "tracking; sliding along x is not observable"; "no contact";
  /// "lost: too little overlap; touch a place you have seen"
  std::string words;
  std::string progress;  ///< of the last steps, while finishing: "34%, 12 s left"; or ""
  /// What is wrong for longer than a frame (log stopped: disk full; background doubtful).
  std::vector<std::string> warnings;
  std::string
      failure;  ///< what ended the scan, or kept it from being saved whole; also among the warnings; or ""
  std::string run_folder;           ///< where it is saved; "" without one
  std::string source;               ///< RawFrameSource::description()
  double rate_hz = 0;               ///< measured over the last seconds
  std::int64_t frames = 0;          ///< that arrived since the scan began
  std::int64_t lost_by_camera = 0;  ///< gaps in the driver's count
  std::int64_t dropped = 0;         ///< arrived, but not tracked because we were behind
  std::int64_t damaged = 0;         ///< pictures that could not be decoded
  double latency_ms = 0;            ///< median from a frame's capture to its pose line, last seconds
  double latency_p99_ms = 0;        ///< 99 of 100 frames take less
  double age_s = 0;                 ///< of the scan
  int keyframes = 0, loops = 0, trials = 0, components = 0;
  double memory_mb = 0;        ///< resident, of the whole program
  std::int64_t log_bytes = 0;  ///< recorded so far; 0 without a log
  GradientScale gradient_scale;
  /// Two standard deviations of the pose that is known worst, of what was saved; 0: nothing was.
  double drift_mm = 0, drift_deg = 0;
  std::vector<std::string> reservations;  ///< reservations() of what was saved; say them when finished
};

/// The newest frame that went through the tracker.
struct LiveTouch : FrameRecord {
  cv::Mat3b image{};     ///< at the profile's resolution
  SurfacePtr surface{};  ///< null while the background is measured
  Pose trial_T_frame = Pose::Identity();
  std::string hidden{};  ///< motions that have not been observable for a while, in words; or ""
};

/// As they came from the camera.
using BackgroundFrames = std::vector<std::shared_ptr<const RawFrame>>;

/// A live scan as the window sees it, and what a person can ask of it. All functions may be called from the
/// window's thread at any time and return at once; what was asked for happens soon after.
class LiveSession {
 public:
  virtual ~LiveSession() = default;
  virtual LiveStatus status() const = 0;
  virtual std::shared_ptr<const LiveTouch> touch() const = 0;  ///< null before the first frame
  virtual std::shared_ptr<const MapSnapshot> map() const = 0;  ///< never null
  /// LiveOptions::mesh_feed.
  virtual std::shared_ptr<const MeshFeed> mesh() const = 0;

  /// A log waits meanwhile. A camera cannot: its frames are left out, and the trial ends.
  virtual void set_paused(bool paused) = 0;
  virtual void stop() = 0;  ///< drains, closes loops, fuses, saves; phase goes to finishing, then finished
  virtual void
  abort() = 0;  ///< stop(), and leave out whatever takes time: loops not searched yet, refinement

  /// Waits until the source has ended or stop() was called and everything is saved. Throws what a stage
  /// threw: an Error when the source does not fit or nothing could be saved.
  virtual RunReport wait() = 0;
  /// What the background was made of, once wait() has returned; none of an image, or without a background.
  virtual BackgroundFrames background_frames() const = 0;
};

}  // namespace gelslam
