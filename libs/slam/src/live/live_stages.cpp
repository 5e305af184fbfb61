#include "live/live_stages.hpp"

#include <algorithm>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam::slam::detail {

SurfaceStage::SurfaceStage(LiveContext& context)
    : context_(context),
      decoder_(context.options.config.sensor),
      frames_(context.options.config, context.options.background, context.options.force, context.timer,
              context.options.background_frames) {
  if (frames_.has_background()) report_background();
}

void SurfaceStage::run() {
  const auto max_background_frames = static_cast<std::size_t>(context_.options.config.background_frames);
  while (const std::optional<RawFramePtr> frame = context_.raw.pop()) {
    std::optional<TactileImage> image = decode(**frame);
    if (!image) continue;
    if ((*frame)->reconnects != reconnects_) {
      reconnects_ = (*frame)->reconnects;
      context_.surfaced.push_beyond_limit(BreakTrial{});
      frames_.compare_background();
      report_background();
    }
    const bool had_background = frames_.has_background();
    SurfacePtr surface = frames_.push(image->bgr, image->index);
    if (!had_background) {
      background_frames_.push_back(*frame);
      if (background_frames_.size() > max_background_frames) background_frames_.pop_front();
      report_background();
    }
    if (!frames_.difference().empty()) {
      // The reconnected camera has another gel. The scan ends with what was measured before.
      context_.board.warn(frames_.difference());
      context_.lost = true;
      return;
    }
    if (had_background)
      for (const std::string& warning : frames_.warnings()) context_.board.warn(warning);
    const LiveClock::time_point arrived = (*frame)->arrived;
    if (!context_.surfaced.push(
            SurfacedFrame{{std::move(*image), std::move(surface)}, arrived, arrived - (*frame)->age}))
      return;
  }
}

std::optional<TactileImage> SurfaceStage::decode(const RawFrame& frame) {
  const auto scope = context_.timer.measure("decode");
  std::optional<TactileImage> image = decoder_.decode(frame);
  if (!image) {
    context_.board.count(&LiveStatus::damaged, 1);
    context_.board.warn_about("the pictures", decoder_.warning());
  }
  return image;
}

BackgroundFrames SurfaceStage::background_frames() const {
  if (!frames_.has_background()) return {};
  return {background_frames_.begin(), background_frames_.end()};
}

void SurfaceStage::report_background() {
  if (frames_.has_background()) {
    for (const std::string& warning : frames_.warnings()) context_.board.warn(warning);
    context_.board.set_phase(LivePhase::scanning);
    return;
  }
  context_.board.set_phase(LivePhase::background);
  const BackgroundCheck& refusal = frames_.refusal();
  context_.board.set_state(refusal.contact   ? refusal.request()
                           : refusal.markers ? refusal.reason
                                             : "taking the background: do not touch the gel");
}

void TrackingStage::run() {
  while (const std::optional<TrackerMessage> message = context_.surfaced.pop())
    std::visit([this](const auto& content) { handle(content); }, *message);
  hand_on(context_.slam->end_tracking());
}

void TrackingStage::handle(const SurfacedFrame& frame) {
  const TactileImage& image = frame.image;
  const ScanRecord& so_far = context_.so_far;
  const TrackedFrame tracked =
      context_.slam->track(so_far.next_frame() + image.index, so_far.next_time_s() + image.time_s,
                           frame.surface, context_.timer, image.unix_us);
  const std::shared_ptr<const MapSnapshot> map = context_.board.map();
  const FrameRecord record = record_of(tracked);
  newer_.insert(newer_.end(), tracked.new_keyframes.begin(), tracked.new_keyframes.end());
  std::erase_if(newer_, [&](const NewKeyframe& added) { return map->find(added.keyframe->id) != nullptr; });
  if (tracked.status == TrackStatus::tracked) unobservable_.pass(record);
  FrameReport report{.tracked = tracked,
                     .image = image.bgr,
                     .surface = frame.surface,
                     .in_map = map->pose_of(record, newer_),
                     .warning = unobservable_.words()};
  if (context_.options.stream) {
    report.in_trial = trial_map_.add(tracked);  // Only stream lines contain the pose in the trial.
    context_.options.stream->write(report);
  }
  if (frame.surface)
    context_.timer.add("capture to pose",
                       std::chrono::duration<double, std::milli>(LiveClock::now() - frame.captured).count());
  context_.board.set_touch(std::move(report), frame.captured);
  hand_on(tracked.new_keyframes);
}

/// Passes keyframes to the mapping thread.
void TrackingStage::hand_on(const std::vector<NewKeyframe>& keyframes) {
  for (const NewKeyframe& added : keyframes) context_.keyframes.push_beyond_limit(added);
}

void FusionStage::set_map(std::shared_ptr<const MapSnapshot> map) {
  const std::lock_guard lock(mutex_);
  newest_ = std::move(map);
  changed_.notify_one();
}

void FusionStage::stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  changed_.notify_one();
}

/// Returns the newest map if it was not taken yet, and otherwise null. Waits for a new map if no work is
/// left.
std::shared_ptr<const MapSnapshot> FusionStage::wait_for_map(bool work_left) {
  std::unique_lock lock(mutex_);
  if (!work_left) changed_.wait(lock, [this] { return stopped_ || newest_; });
  return std::exchange(newest_, nullptr);
}

void FusionStage::run() {
  bool work_left = false;
  while (true) {
    if (const auto map = wait_for_map(work_left)) follow(*map);
    {
      const std::lock_guard lock(mutex_);
      if (stopped_) return fusion_.reset();  // The saved mesh needs the memory.
    }
    if (fusion_) work_left = work();
  }
}

/// Fuses a part of what is left and returns whether work is left. If a patch cannot be fused, a warning is
/// given and fusion continues without it.
bool FusionStage::work() {
  const auto scope = context_.timer.measure("fusion");
  try {
    const bool work_left = fusion_->work();
    context_.options.mesh_feed->add(std::exchange(cleared_, false), fusion_->take_changed_blocks());
    return work_left;
  } catch (const Error& error) {
    context_.board.warn(error.what());
    return true;
  }
}

void FusionStage::follow(const MapSnapshot& map) {
  if (!fusion_ || map.shown_component != component_) {
    fusion_ = std::make_unique<IncrementalFusion>(context_.options.config.slam.fusion, IncrementalOptions{});
    component_ = map.shown_component;
    cleared_ = true;
  }
  fusion_->set_patches(posed_surfaces(map), map.gradient_scale.mean());
}

namespace {

constexpr std::chrono::milliseconds kMaxUpdateInterval{200};

}  // namespace

void MappingStage::run() {
  if (!context_.so_far.keyframes.empty()) mapper().optimize();
  publish();
  mapper().remember_places();  // Done now, so that no keyframe has to wait for it later.
  while (context_.keyframes.wait_until(next_work())) {
    // All keyframes that have arrived are processed before the graph is solved once for all of them. The time
    // limit keeps the displayed map current.
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
    publish();
  }
}

void MappingStage::publish() {
  auto map = std::make_shared<const MapSnapshot>(mapper().snapshot());
  if (context_.options.stream) context_.options.stream->set_map(map);
  if (context_.options.mesh_feed) fusion_.set_map(map);
  context_.board.set_map(std::move(map));
}

/// Returns the time until which the mapping thread waits for a keyframe. If there are new loops, this is when
/// the pose graph may be solved next.
LiveClock::time_point MappingStage::next_work() {
  return mapper().has_new_loops() ? next_optimization_ : LiveClock::now() + std::chrono::hours(1);
}

/// Solves the pose graph if it has new loops and the last solve is long enough ago; returns whether it did. A
/// full solve moves the whole map, and the displayed mesh has to follow. The pause between two solves is
/// therefore at least 1 s, and at least nine times the duration of the last solve.
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
