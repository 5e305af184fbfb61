#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/slam/continue_scan.hpp"
#include "gelslam/slam/live_session.hpp"
#include "gelslam/slam/reconstruct.hpp"

namespace gelslam {

class PoseStream;

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
  std::int64_t keep_free_bytes = 0;    ///< LogRecorderOptions
  std::shared_ptr<PoseStream> stream;  ///< gets every frame's pose; null: none
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
