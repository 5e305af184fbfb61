#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <variant>
#include <vector>

#include "gelslam/core/bounded_queue.hpp"
#include "gelslam/core/stage_timer.hpp"
#include "gelslam/fusion/incremental_fusion.hpp"
#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "gelslam/slam/live_slam.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/slam/trajectory_uncertainty.hpp"
#include "live/live_board.hpp"

// The stages of a live scan. Each runs on its own thread until its input queue is closed and empty.
namespace gelslam::slam::detail {

using RawFramePtr = std::shared_ptr<const RawFrame>;

/// Message from the surface stage to the tracker: the surface of a frame.
struct SurfacedFrame : SurfaceStream::Item {
  LiveClock::time_point arrived, captured;
};

/// Message from the surface stage to the tracker: end the trial between two frames.
struct BreakTrial {};

using TrackerMessage = std::variant<SurfacedFrame, BreakTrial>;

/// State that the stages of a live scan share.
struct LiveContext {
  LiveContext(const LiveOptions& live_options, const std::string& source)
      : options(live_options),
        so_far(options.continued ? options.continued->record : ScanRecord{}),
        board(source) {}

  const LiveOptions options;
  ScanRecord so_far;            ///< The scan that is continued; for a new scan only its part.
  std::optional<GelSlam> slam;  ///< Set when the threads begin.
  StageTimer timer;
  LiveBoard board;
  std::atomic<bool> aborted{false};
  /// Set when the source is lost or has another gel; the scan then ends early. Not related to lost frames.
  std::atomic<bool> lost{false};

  static constexpr std::size_t kQueuedFrames = 2;  ///< Short, because queued frames only add latency.
  BoundedQueue<RawFramePtr> raw{kQueuedFrames};
  BoundedQueue<TrackerMessage> surfaced{kQueuedFrames};
  BoundedQueue<NewKeyframe> keyframes{1};  ///< The limit is never applied, as the tracker pushes beyond it.
  SessionQueue measured{1};                ///< The same holds here.
};

/// Computes surfaces from raw frames. While the first frames show contact, it asks the user to take the
/// object away.
class SurfaceStage {
 public:
  /// Throws Error when the model or the background image cannot be read.
  explicit SurfaceStage(LiveContext& context);

  void run();
  /// LiveSession::background_frames(); after run().
  BackgroundFrames background_frames() const;

 private:
  std::optional<TactileImage> decode(const RawFrame& frame);
  void report_background();

  LiveContext& context_;
  FrameDecoder decoder_;
  FrameToSurface frames_;
  int reconnects_ = 0;                         // Value of the last frame.
  std::deque<RawFramePtr> background_frames_;  // The newest frames, until they are accepted as background.
};

/// Computes poses from surfaces. Keyframes are passed to the mapper through a queue without limit, so that
/// this stage never waits.
class TrackingStage {
 public:
  explicit TrackingStage(LiveContext& context)
      : context_(context), trial_map_(context.options.config.slam.gradient_scale) {}

  void run();

 private:
  void handle(const SurfacedFrame& frame);
  void handle(BreakTrial) { hand_on(context_.slam->end_tracking()); }
  void hand_on(const std::vector<NewKeyframe>& keyframes);

  LiveContext& context_;
  TrialMap trial_map_;
  UnobservableMotions unobservable_;
  std::vector<NewKeyframe> newer_;  // Keyframes that the newest map does not contain yet.
};

/// Updates the displayed mesh to the newest map in small steps. Maps that arrive faster than it works are
/// skipped.
class FusionStage {
 public:
  explicit FusionStage(LiveContext& context) : context_(context) {}

  void run();
  /// To be called from another thread; returns immediately.
  void set_map(std::shared_ptr<const MapSnapshot> map);
  void stop();  ///< Makes run() return after the current step.

 private:
  std::shared_ptr<const MapSnapshot> wait_for_map(bool work_left);
  void follow(const MapSnapshot& map);
  bool work();  ///< Returns true while there is more to do.

  LiveContext& context_;
  std::unique_ptr<IncrementalFusion> fusion_;
  int component_ = -1;    // Component of the map that fusion_ contains.
  bool cleared_ = false;  // True until the mesh feed has been told that the mesh was cleared.

  std::mutex mutex_;
  std::condition_variable changed_;
  std::shared_ptr<const MapSnapshot> newest_;
  bool stopped_ = false;
};

/// Searches loops for every keyframe, adds each new keyframe to the map at the pose of its odometry edge, and
/// solves the pose graph when the queue is empty.
class MappingStage {
 public:
  MappingStage(LiveContext& context, FusionStage& fusion) : context_(context), fusion_(fusion) {}

  void run();

 private:
  Mapper& mapper() { return context_.slam->mapper(); }
  void publish();
  LiveClock::time_point next_work();
  bool optimize_if_due();

  LiveContext& context_;
  FusionStage& fusion_;
  LiveClock::time_point next_optimization_ = LiveClock::now();
};

}  // namespace gelslam::slam::detail
