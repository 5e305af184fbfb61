#include "gelslam/core/error.hpp"
#include "live/live_stages.hpp"

namespace gelslam::slam::detail {

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

/// The newest map, if it was not taken yet; waits for one when there is no other work.
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
      if (stopped_) return fusion_.reset();  // the saved mesh needs the memory
    }
    if (fusion_) work_left = work();
  }
}

/// A patch that cannot be fused is reported; fusion goes on without it.
bool FusionStage::work() {
  const auto scope = context_.timer.measure("fusion");
  try {
    const bool work_left = fusion_->work();
    context_.options.mesh_feed->add(std::exchange(cleared_, false), fusion_->take_changed_blocks());
    return work_left;
  } catch (const Error& error) {
    context_.board.warn(error.what());
    return false;
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

}  // namespace gelslam::slam::detail
