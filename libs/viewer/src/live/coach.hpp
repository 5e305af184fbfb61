#pragma once

#include <future>
#include <memory>
#include <optional>
#include <string>

#include "gelslam/slam/guidance.hpp"

namespace gelslam::viewer::detail {

/// Concludes about once a second what a person should do next, on a thread of its own.
class Coach {
 public:
  ~Coach();
  /// True when there is a new conclusion.
  bool advance(const MeshBlocks& blocks, const MapSnapshot& map,
               const std::optional<Eigen::Vector3f>& touch_mm, double now_s);
  const Guidance& guidance() const { return guidance_; }

 private:
  std::shared_ptr<MeshBorder> border_ = std::make_shared<MeshBorder>();  ///< of the thread while it runs
  std::future<Guidance> thinking_;
  Guidance guidance_;
  double next_s_ = 0;
  MeshBlocks blocks_;  ///< of the last conclusion
  std::uint64_t map_version_ = 0;
  Eigen::Vector3f touch_mm_ = Eigen::Vector3f::Zero();
};

/// "62 % closed, drift at most 0.03 mm": two standard deviations, where it is known.
std::string progress_words(const Guidance& guidance);
/// What to do next, as a sentence; "" when there is no surface yet.
std::string guidance_words(const Guidance& guidance);

}  // namespace gelslam::viewer::detail
