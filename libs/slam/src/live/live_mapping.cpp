#include <algorithm>
#include <memory>
#include <utility>

#include "gelslam/slam/pose_stream.hpp"
#include "live/live_stages.hpp"

namespace gelslam::slam::detail {
namespace {

constexpr std::chrono::milliseconds kMaxUpdateInterval{200};

}  // namespace

void MappingStage::run() {
  if (!context_.so_far.keyframes.empty()) mapper().optimize();
  publish();
  while (context_.keyframes.wait_until(next_work())) {
    // What has arrived is handled before the graph is solved once for all of it. A time limit keeps the
    // displayed map current.
    const LiveClock::time_point start = LiveClock::now();
    bool changed = false;
    while (LiveClock::now() - start < kMaxUpdateInterval) {
      const std::optional<NewKeyframe> added = context_.keyframes.try_pop();
      if (!added) break;
      context_.slam->close_loops(*added, context_.timer, !context_.aborted);
      changed = true;
    }
    if (context_.keyframes.size() == 0 && optimize_if_due()) changed = true;
    if (!changed) continue;
    if (context_.keyframes.size() == 0) assess_if_due();
    publish();
  }
}

void MappingStage::publish() {
  auto map = std::make_shared<const MapSnapshot>(mapper().snapshot());
  if (context_.options.stream) context_.options.stream->write_map(map);
  if (context_.options.mesh_feed) fusion_.set_map(map);
  context_.board.set_map(std::move(map));
}

/// Without a keyframe.
LiveClock::time_point MappingStage::next_work() {
  return mapper().has_new_loops() ? next_optimization_ : LiveClock::now() + std::chrono::hours(1);
}

/// For at most a twentieth of the time.
void MappingStage::assess_if_due() {
  const LiveClock::time_point start = LiveClock::now();
  if (start < next_assessment_) return;
  {
    const auto scope = context_.timer.measure("uncertainty");
    mapper().assess();
  }
  const LiveClock::time_point end = LiveClock::now();
  next_assessment_ = end + std::max<LiveClock::duration>(std::chrono::milliseconds(500), 19 * (end - start));
}

/// A full solve moves the whole map, and the mesh has to follow: only after new loops, and for at most a
/// tenth of the time.
bool MappingStage::optimize_if_due() {
  const LiveClock::time_point start = LiveClock::now();
  if (!mapper().has_new_loops() || start < next_optimization_) return false;
  {
    const auto scope = context_.timer.measure("pose graph");
    mapper().optimize();
  }
  const LiveClock::time_point end = LiveClock::now();
  next_optimization_ = end + std::max<LiveClock::duration>(std::chrono::seconds(1), 9 * (end - start));
  return true;
}

}  // namespace gelslam::slam::detail
