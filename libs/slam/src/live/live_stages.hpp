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

// Each stage runs on a thread of its own until its queue is closed and empty.
namespace gelslam::slam::detail {

using RawFramePtr = std::shared_ptr<const RawFrame>;

/// From the surface stage to the tracker.
struct SurfacedFrame : SurfaceStream::Item {
  LiveClock::time_point arrived, captured;
};

/// Travels with the frames, so that it happens between two of them.
struct BreakTrial {};

using TrackerMessage = std::variant<SurfacedFrame, BreakTrial>;

/// What the stages of a live scan share.
struct LiveContext {
  LiveContext(const LiveOptions& live_options, const std::string& source)
      : options(live_options),
        so_far(options.continued ? options.continued->record : ScanRecord{}),
        board(source) {}

  const LiveOptions options;
  ScanRecord so_far;            ///< the scan that goes on; of a new one its part alone
  std::optional<GelSlam> slam;  ///< once the threads begin
  StageTimer timer;
  LiveBoard board;
  std::atomic<bool> aborted{false};
  std::atomic<bool> lost{false};  ///< the source is lost (not track), or has another gel: the scan ends early

  static constexpr std::size_t kQueuedFrames = 2;  ///< what is older is not worth its latency
  BoundedQueue<RawFramePtr> raw{kQueuedFrames};
  BoundedQueue<TrackerMessage> surfaced{kQueuedFrames};
  BoundedQueue<NewKeyframe> keyframes{1};  ///< its limit is never asked for: the tracker goes beyond it
  SessionQueue measured{1};                ///< the same
};

/// Raw frames to surfaces. While the first frames show contact, the user is told to take the object away.
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
  int reconnects_ = 0;                         // of the last frame
  std::deque<RawFramePtr> background_frames_;  // the newest ones, until they are accepted
};

/// Surfaces to poses; keyframes go on to the mapper, whose queue has no limit, so that this stage never
/// waits.
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
  std::vector<NewKeyframe> newer_;  // that the newest map does not have yet
};

/// Updates the displayed mesh to the newest map in short steps and skips maps that arrive faster.
class FusionStage {
 public:
  explicit FusionStage(LiveContext& context) : context_(context) {}

  void run();
  void set_map(std::shared_ptr<const MapSnapshot> map);  ///< from another thread; returns at once
  void stop();                                           ///< run() returns after the present piece of work

 private:
  std::shared_ptr<const MapSnapshot> wait_for_map(bool work_left);
  void follow(const MapSnapshot& map);
  bool work();  ///< true while there is more to do

  LiveContext& context_;
  std::unique_ptr<IncrementalFusion> fusion_;
  int component_ = -1;    // what fusion_ holds
  bool cleared_ = false;  // not told yet

  std::mutex mutex_;
  std::condition_variable changed_;
  std::shared_ptr<const MapSnapshot> newest_;
  bool stopped_ = false;
};

/// Searches loops for every keyframe, places the newest by its link at once, and solves for all poses when
/// the queue is empty.
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
