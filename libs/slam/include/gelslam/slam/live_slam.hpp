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

/// The state of a scan for the user, in words and figures. Cheap to copy.
struct LiveStatus {
  LivePhase phase = LivePhase::background;
  bool is_scan = true;  ///< false: tracking alone, which saves nothing and can only be stopped
  /// `lost` lasts until what is touched now has been joined to the shown map.
  TrackStatus track = TrackStatus::no_contact;
  /// "lost", "too little overlap", "touch a place you have seen". While tracking, the reason says why the
  /// place is uncertain.
  std::string state, reason, advice;
  std::string progress;  ///< of the last steps, while finishing: "34%, 12 s left"; or ""
  /// What is wrong for longer than a frame (log stopped: disk full; background doubtful).
  std::vector<std::string> warnings;
  std::string failure;     ///< what ended the scan, or kept it from being saved whole (a warning, too); or ""
  std::string run_folder;  ///< where it is saved; "" without one
  std::string source;      ///< RawFrameSource::description()
  double rate_hz = 0;      ///< measured over the last seconds
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
  double saved_drift_mm = 0, saved_drift_deg = 0;
  std::string touched;  ///< describe(RunReport::touched) of what was saved; or ""
  std::vector<std::string>
      result_warnings;  ///< RunReport::result_warnings of what was saved; say them when finished
};

/// As they came from the camera.
using BackgroundFrames = std::vector<std::shared_ptr<const RawFrame>>;

/// A live scan as the window sees it, and what a person can ask of it. All functions may be called from the
/// window's thread at any time and return at once; what was asked for happens soon after.
class LiveSession {
 public:
  virtual ~LiveSession() = default;
  virtual LiveStatus status() const = 0;
  /// The newest frame that was tracked; null before the first.
  virtual std::shared_ptr<const FrameReport> touch() const = 0;
  virtual std::shared_ptr<const MapSnapshot> map() const = 0;  ///< never null
  /// LiveOptions::mesh_feed.
  virtual std::shared_ptr<const MeshFeed> mesh() const = 0;

  /// A log waits meanwhile. A camera cannot: its frames are left out, and the trial ends.
  virtual void set_paused(bool paused) = 0;
  virtual void stop() = 0;   ///< drains, closes loops, fuses, saves; phase goes to finishing, then finished
  virtual void abort() = 0;  ///< stop(), and leave out what takes time: loops not searched yet, refinement

  /// Waits until the source has ended or stop() was called and everything is saved. Throws what a stage
  /// threw: an Error when the source does not fit or nothing could be saved.
  virtual RunReport wait() = 0;
  /// What the background was made of, once wait() has returned; none of an image, or without a background.
  virtual BackgroundFrames background_frames() const = 0;
};

struct LiveOptions {
  Config config;                     ///< with the model path resolved
  std::filesystem::path log;         ///< what is replayed; empty for a camera
  std::filesystem::path background;  ///< an image; empty: the first frames
  bool force = false;                ///< take the first frames as background whatever they show
  std::optional<FrameRange> background_frames = {};  ///< as in LogInput
  /// A camera does not wait: frames that arrive while we are behind are left out, whole. False: every frame
  /// is used, as fast as it can be.
  bool drop_when_behind = true;
  std::filesystem::path run_folder;  ///< empty: nothing is kept
  bool overwrite = false;
  std::optional<ContinuedScan> continued = {};  ///< the scan in `run_folder` goes on
  /// Record every frame that arrives into the run folder's log.mkv, with these attachments.
  std::optional<LogAttachments> record;
  std::int64_t keep_free_bytes = 0;  ///< LogRecorderOptions
  std::shared_ptr<LineFeed> stream;  ///< gets every frame and map; null: none
  /// Gets the mesh of the shown component as it grows, then the saved one; null: nobody looks at it.
  std::shared_ptr<MeshFeed> mesh_feed;
  /// What can wait (RawFrameSource::hold()) does until this is true; what a camera sees before is recorded,
  /// and left out. None: at once.
  std::function<bool()> begins;
};

/// Throws Error when begin_live_scan() would refuse the run folder: to be asked before a camera is disturbed.
/// Makes nothing.
void check_run_folder(const LiveOptions& options);

/// The live chain: capture, surface, tracking, mapping (loops and pose graph) and fusion, each on its own
/// thread with queues between them. Tracking never waits for what comes behind it; every keyframe is searched
/// for loops, however late. Without dropped frames its map at the end is the one that reconstruct() makes of
/// the same log. Starts at once; a session that goes before wait() has returned aborts. Throws Error when the
/// model cannot be read or the run folder may not be written.
std::unique_ptr<LiveSession> begin_live_scan(std::unique_ptr<RawFrameSource> source,
                                             const LiveOptions& options);

}  // namespace gelslam
