#include "live/live_mapping.hpp"

#include <algorithm>
#include <memory>

namespace gelslam::slam::detail {
namespace {

constexpr std::chrono::milliseconds kLongestSilence{200};

}  // namespace

void MappingStage::run(MapperQueue& in, const std::atomic<bool>& hurry,
                       const std::function<void(std::shared_ptr<const MapSnapshot>)>& publish,
                       const std::function<void(const std::vector<FrameRecord>&)>& save) {
  const auto handle = [&](const MapperMessage& message) {
    if (const auto* added = std::get_if<NewKeyframe>(&message)) {
      const auto scope = timer_.measure("loop closure");
      mapper_->add_keyframe(*added, !hurry);
    } else if (const auto* forget = std::get_if<ForgetFromTrial>(&message)) {
      mapper_->forget_from_trial(forget->trial);
    } else if (const auto* start = std::get_if<StartScan>(&message)) {
      mapper_.emplace(options_);
      scan_ = start->scan;
    } else {
      save(std::get<SaveSoFar>(message).records);
    }
  };
  while (const std::optional<MapperMessage> message = in.pop()) {
    handle(*message);
    // What has come meanwhile, before the graph is solved once for all of it; but whoever looks should not
    // wait long.
    const LiveClock::time_point start = LiveClock::now();
    while (LiveClock::now() - start < kLongestSilence) {
      const std::optional<MapperMessage> more = in.try_pop();
      if (!more) break;
      handle(*more);
    }
    {
      const auto scope = timer_.measure("pose graph");
      mapper_->update();
    }
    if (in.size() == 0) settle_if_worth_it();
    MapSnapshot map = mapper_->snapshot();
    map.scan = scan_;
    publish(std::make_shared<const MapSnapshot>(std::move(map)));
  }
}

/// A full solve moves the whole map, and the mesh after it: only for new loops, and for a tenth of the time
/// at most.
void MappingStage::settle_if_worth_it() {
  const LiveClock::time_point start = LiveClock::now();
  if (!mapper_->unsettled() || start < next_settle_) return;
  {
    const auto scope = timer_.measure("pose graph, whole");
    mapper_->settle();
  }
  const LiveClock::time_point end = LiveClock::now();
  next_settle_ = end + std::max<LiveClock::duration>(std::chrono::seconds(1), 9 * (end - start));
}

SlamMap MappingStage::finish(const std::vector<FrameRecord>& records,
                             const std::function<bool()>& stop_requested) const {
  return mapper_->finish(records, !stop_requested(), stop_requested);
}

}  // namespace gelslam::slam::detail
