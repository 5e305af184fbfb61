#include "live/live_mapping.hpp"

#include <algorithm>
#include <memory>
#include <utility>

namespace gelslam::slam::detail {
namespace {

constexpr std::chrono::milliseconds kMaxUpdateInterval{200};

}  // namespace

void MappingStage::restore(const ScanRecord& record, const Found& found) {
  if (record.keyframes.empty()) {
    mapper_.restore(record);
    return;
  }
  const auto scope = timer_.measure("loop closure");
  for (auto& [keyframe, loops] : mapper_.restore(record)) found(keyframe, loops);
  mapper_.optimize();
}

void MappingStage::run(MapperQueue& in, const std::atomic<bool>& aborted, const Found& found,
                       const std::function<void(std::shared_ptr<const MapSnapshot>)>& publish,
                       const std::function<void(const SaveSoFar&)>& save) {
  const auto handle = [&](const MapperMessage& message) {
    if (const auto* added = std::get_if<NewKeyframe>(&message)) {
      const auto scope = timer_.measure("loop closure");
      const bool search_loops = !aborted;
      std::vector<PoseGraphEdge> loops = mapper_.add_keyframe(*added, search_loops);
      if (search_loops) found(added->keyframe->id, std::move(loops));
    } else if (const auto* forget = std::get_if<ForgetFromTrial>(&message)) {
      mapper_.forget_from_trial(forget->trial);
    } else {
      save(std::get<SaveSoFar>(message));
    }
  };
  publish(std::make_shared<const MapSnapshot>(mapper_.snapshot()));
  while (in.wait_until(next_work())) {
    // What has arrived is handled before the graph is solved once for all of it. A time limit keeps the
    // displayed map current.
    const LiveClock::time_point start = LiveClock::now();
    bool changed = false;
    while (LiveClock::now() - start < kMaxUpdateInterval) {
      const std::optional<MapperMessage> message = in.try_pop();
      if (!message) break;
      handle(*message);
      changed = true;
    }
    if (in.size() == 0 && optimize_if_due()) changed = true;
    if (!changed) continue;
    if (in.size() == 0) assess_if_due();
    publish(std::make_shared<const MapSnapshot>(mapper_.snapshot()));
  }
}

/// Without a message.
LiveClock::time_point MappingStage::next_work() const {
  return mapper_.has_new_loops() ? next_optimization_ : LiveClock::now() + std::chrono::hours(1);
}

/// For at most a twentieth of the time.
void MappingStage::assess_if_due() {
  const LiveClock::time_point start = LiveClock::now();
  if (start < next_assessment_) return;
  {
    const auto scope = timer_.measure("uncertainty");
    mapper_.assess();
  }
  const LiveClock::time_point end = LiveClock::now();
  next_assessment_ = end + std::max<LiveClock::duration>(std::chrono::milliseconds(500), 19 * (end - start));
}

/// A full solve moves the whole map, and the mesh has to follow: only after new loops, and for at most a
/// tenth of the time.
bool MappingStage::optimize_if_due() {
  const LiveClock::time_point start = LiveClock::now();
  if (!mapper_.has_new_loops() || start < next_optimization_) return false;
  {
    const auto scope = timer_.measure("pose graph");
    mapper_.optimize();
  }
  const LiveClock::time_point end = LiveClock::now();
  next_optimization_ = end + std::max<LiveClock::duration>(std::chrono::seconds(1), 9 * (end - start));
  return true;
}

SlamMap MappingStage::finish(const std::vector<FrameRecord>& records,
                             const std::function<bool()>& stop_requested, ProgressSink* progress) const {
  return mapper_.finish(records, !stop_requested(), stop_requested, progress);
}

}  // namespace gelslam::slam::detail
