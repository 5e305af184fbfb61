#pragma once

#include <atomic>
#include <functional>
#include <optional>

#include "gelslam/core/stage_timer.hpp"
#include "gelslam/slam/mapper.hpp"
#include "live/live_messages.hpp"

namespace gelslam::slam::detail {

/// The mapping thread: it searches loops for every keyframe, places the newest by its link at once, and
/// solves for all poses when the queue is empty.
class MappingStage {
 public:
  MappingStage(const SlamOptions& options, StageTimer& timer) : mapper_(options), timer_(timer) {}

  /// What was found of a keyframe that was searched for loops.
  using Found = std::function<void(int keyframe, std::vector<PoseGraphEdge> loops)>;

  /// Before run(): the scan that goes on; of a new one its part.
  void restore(const ScanRecord& record, const Found& found);

  /// `publish` is called with every new map, `save` when a person asked for it; all from this thread.
  void run(MapperQueue& in, const std::atomic<bool>& aborted, const Found& found,
           const std::function<void(std::shared_ptr<const MapSnapshot>)>& publish,
           const std::function<void(const SaveSoFar&)>& save);

  /// The final map; `stop_requested` leaves out the rest of the refinement. From the thread of run()
  /// or after it.
  SlamMap finish(const std::vector<FrameRecord>& records, const std::function<bool()>& stop_requested,
                 ProgressSink* progress = nullptr) const;

 private:
  LiveClock::time_point next_work() const;
  bool optimize_if_due();
  void assess_if_due();

  Mapper mapper_;
  StageTimer& timer_;
  LiveClock::time_point next_optimization_ = LiveClock::now(), next_assessment_ = next_optimization_;
};

}  // namespace gelslam::slam::detail
