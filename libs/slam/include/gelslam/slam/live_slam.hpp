#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/core/run_report.hpp"
#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/slam/continue_scan.hpp"
#include "gelslam/slam/line_feed.hpp"
#include "gelslam/slam/mesh_feed.hpp"
#include "gelslam/slam/reconstruct.hpp"
#include "gelslam/slam/slam_map.hpp"

namespace gelslam {

enum class LivePhase { background, scanning, paused, finishing, finished };

/// State of a scan for the user, as text and numbers. Cheap to copy.
struct LiveStatus {
  LivePhase phase = LivePhase::background;
  bool is_scan = true;  ///< False for tracking alone, which saves nothing and can only be stopped.
  /// The status stays `lost` until the current contact has been joined to the shown map.
  TrackStatus track = TrackStatus::no_contact;
  /// For example "lost", "too little overlap", "touch a place you have seen". While tracking, `reason` says
  /// why the pose is uncertain.
  std::string state, reason, advice;
  std::string progress;  ///< Progress of the last steps while finishing, as "34%, 12 s left"; or "".
  /// Problems that last longer than one frame, such as a full disk that stopped the log, or a doubtful
  /// background.
  std::vector<std::string> warnings;
  /// The error that ended the scan, or because of which it could not be saved completely (then it is also a
  /// warning); or "".
  std::string failure;
  std::string run_folder;           ///< Where the scan is saved; "" if it is not.
  std::string source;               ///< RawFrameSource::description()
  double rate_hz = 0;               ///< Frame rate measured over the last seconds.
  std::int64_t frames = 0;          ///< Number of frames that arrived since the scan began.
  std::int64_t lost_by_camera = 0;  ///< Frames that are missing according to the driver's frame counter.
  /// Frames that arrived but were not tracked because the computer was too slow.
  std::int64_t dropped = 0;
  std::int64_t damaged = 0;  ///< Images that could not be decoded.
  double latency_ms = 0;     ///< Median over the last seconds of the time from a frame's capture to its pose.
  double latency_p99_ms = 0;  ///< The same as 99 % quantile.
  double age_s = 0;           ///< Time since the scan began.
  int keyframes = 0, loops = 0, trials = 0, components = 0;
  double memory_mb = 0;        ///< Resident memory of the whole program.
  std::int64_t log_bytes = 0;  ///< Size of the recorded log; 0 without a log.
  GradientScale gradient_scale;
  /// Two standard deviations of the least certain pose in the saved map; 0 if nothing was saved.
  double saved_drift_mm = 0, saved_drift_deg = 0;
  std::string touched;  ///< describe(RunReport::touched) of the saved run; or "".
  std::vector<std::string>
      result_warnings;  ///< RunReport::result_warnings of what was saved; say them when finished
};

/// Background frames as they came from the camera.
using BackgroundFrames = std::vector<std::shared_ptr<const RawFrame>>;

/// Interface of a live scan for a window: its state, and what the user can ask of it. All functions may be
/// called from the window's thread at any time and return immediately; requests are carried out soon
/// afterwards.
class LiveSession {
 public:
  virtual ~LiveSession() = default;
  virtual LiveStatus status() const = 0;
  /// The newest frame that was tracked; null before the first.
  virtual std::shared_ptr<const FrameReport> touch() const = 0;
  virtual std::shared_ptr<const MapSnapshot> map() const = 0;  ///< never null
  /// LiveOptions::mesh_feed.
  virtual std::shared_ptr<const MeshFeed> mesh() const = 0;

  /// Pauses or resumes the scan. The replay of a log waits meanwhile. Frames that a camera sends while paused
  /// are left out, and the current trial ends.
  virtual void set_paused(bool paused) = 0;
  /// Stops capture, then closes loops, fuses and saves. The phase becomes finishing, then finished.
  virtual void stop() = 0;
  /// As stop(), but without the slow steps: loops that were not searched for yet, and refinement.
  virtual void abort() = 0;

  /// Waits until the source has ended or stop() was called, and everything is saved. Throws the exception of
  /// a stage: Error when the source does not fit the configuration or nothing could be saved.
  virtual RunReport wait() = 0;
  /// Returns the frames from which the background was made, once wait() has returned. Empty if the background
  /// is an image, or if there is none.
  virtual BackgroundFrames background_frames() const = 0;
};

struct LiveOptions {
  Config config;                     ///< with the model path resolved
  std::filesystem::path log;         ///< The log that is replayed; empty for a camera.
  std::filesystem::path background;  ///< an image; empty: the first frames
  bool force = false;  ///< Use the first frames as background even if they seem to show contact.
  std::optional<FrameRange> background_frames = {};  ///< as in LogInput
  /// If true, frames that arrive while the program is too slow are left out, as a camera does not wait. If
  /// false, every frame is used, at the speed of the program.
  bool drop_when_behind = true;
  std::filesystem::path run_folder;  ///< Empty if nothing is saved.
  bool overwrite = false;
  std::optional<ContinuedScan> continued = {};  ///< If set, the scan in `run_folder` is continued.
  /// Record every frame that arrives into the run folder's log.mkv, with these attachments.
  std::optional<LogAttachments> record;
  std::int64_t keep_free_bytes = 0;  ///< LogRecorderOptions
  std::shared_ptr<LineFeed> stream;  ///< Receives every frame and map; may be null.
  /// Receives the mesh of the shown component as it grows, and at the end the saved mesh. Null if nothing
  /// displays it.
  std::shared_ptr<MeshFeed> mesh_feed;
  /// The scan begins when this returns true. A source that can wait (RawFrameSource::hold()) waits until
  /// then; frames of a camera are recorded until then but not used. If empty, the scan begins immediately.
  std::function<bool()> begins;
};

/// Throws Error when begin_live_scan() would refuse the run folder, so that this can be found out before a
/// camera is opened. Creates nothing.
void check_run_folder(const LiveOptions& options);

/// Runs a live scan: capture, surface, tracking, mapping (loops and pose graph) and fusion, each on its own
/// thread with queues between them. Tracking never waits for later stages, and every keyframe is searched for
/// loops, however late. If no frames are dropped, the final map equals that of reconstruct() on the same log.
/// The scan starts immediately; if the session is destroyed before wait() has returned, the scan is aborted.
/// Throws Error when the model cannot be read or the run folder may not be written.
std::unique_ptr<LiveSession> begin_live_scan(std::unique_ptr<RawFrameSource> source,
                                             const LiveOptions& options);

}  // namespace gelslam
