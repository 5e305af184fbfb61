#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "gelslam/fusion/incremental_fusion.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/slam/trial_drift.hpp"
#include "live/live_context.hpp"

// Each stage runs on a thread of its own until its queue is closed and empty.
namespace gelslam::slam::detail {

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
  int returns_ = 0;                            // of the last frame
  std::deque<RawFramePtr> background_frames_;  // the newest ones, until they are accepted
};

/// Surfaces to poses; keyframes go on to the mapper, whose queue has no limit, so that this stage never
/// waits.
class TrackingStage {
 public:
  explicit TrackingStage(LiveContext& context) : context_(context) {}

  void run();

 private:
  void handle(const SurfacedFrame& frame);
  void handle(BreakTrial) { hand_on(context_.slam->end_tracking()); }
  void hand_on(const std::vector<NewKeyframe>& keyframes);
  void stream(const TrackedFrame& tracked, const SurfacedFrame& frame);

  LiveContext& context_;
  HiddenMotions hidden_;
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
  void assess_if_due();

  LiveContext& context_;
  FusionStage& fusion_;
  LiveClock::time_point next_optimization_ = LiveClock::now(), next_assessment_ = next_optimization_;
};

}  // namespace gelslam::slam::detail
