#include <algorithm>
#include <memory>
#include <utility>

#include "gelslam/slam/pose_stream.hpp"
#include "live/live_stages.hpp"

namespace gelslam::slam::detail {
namespace {

constexpr std::chrono::milliseconds kMaxUpdateInterval{200};

}  // namespace

void MappingStage::restore() {
  if (context_.so_far.keyframes.empty()) {
    mapper_.restore(context_.so_far);
    return;
  }
  const auto scope = context_.timer.measure("loop closure");
  for (const auto& [keyframe, loops] : mapper_.restore(context_.so_far)) keep_loops(keyframe, loops);
  mapper_.optimize();
}

void MappingStage::run() {
  restore();
  publish();
  while (context_.keyframes.wait_until(next_work())) {
    // What has arrived is handled before the graph is solved once for all of it. A time limit keeps the
    // displayed map current.
    const LiveClock::time_point start = LiveClock::now();
    bool changed = false;
    while (LiveClock::now() - start < kMaxUpdateInterval) {
      const std::optional<NewKeyframe> added = context_.keyframes.try_pop();
      if (!added) break;
      handle(*added);
      changed = true;
    }
    if (context_.keyframes.size() == 0 && optimize_if_due()) changed = true;
    if (!changed) continue;
    if (context_.keyframes.size() == 0) assess_if_due();
    publish();
  }
}

void MappingStage::handle(const NewKeyframe& added) {
  const auto scope = context_.timer.measure("loop closure");
  const bool search_loops = !context_.aborted;
  const std::vector<PoseGraphEdge> loops = mapper_.add_keyframe(added, search_loops);
  if (search_loops) keep_loops(added.keyframe->id, loops);
}

/// Of a keyframe that was searched for them, in the session.
void MappingStage::keep_loops(int keyframe, const std::vector<PoseGraphEdge>& loops) {
  context_.measured.push_beyond_limit([=](Store& store) { store.add_loops(keyframe, loops); });
}

void MappingStage::publish() {
  auto map = std::make_shared<const MapSnapshot>(mapper_.snapshot());
  if (context_.options.stream) context_.options.stream->write_map(map);
  if (context_.options.mesh_feed) fusion_.set_map(map);
  context_.board.set_map(std::move(map));
}

/// Without a keyframe.
LiveClock::time_point MappingStage::next_work() const {
  return mapper_.has_new_loops() ? next_optimization_ : LiveClock::now() + std::chrono::hours(1);
}

/// For at most a twentieth of the time.
void MappingStage::assess_if_due() {
  const LiveClock::time_point start = LiveClock::now();
  if (start < next_assessment_) return;
  {
    const auto scope = context_.timer.measure("uncertainty");
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
    const auto scope = context_.timer.measure("pose graph");
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
