#include "live/coach.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <utility>

#include "gelslam/core/process.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double kIntervalS = 1;
constexpr float kSamePlaceMm = 1;

std::string drift_words(const Guidance& guidance) {
  return guidance.drift_mm ? fmt::format("drift at most {:.2f} mm", std::max(*guidance.drift_mm, 0.01)) : "";
}

}  // namespace

Coach::~Coach() {
  if (thinking_.valid()) thinking_.wait();
}

bool Coach::advance(const MeshBlocks& blocks, const MapSnapshot& map,
                    const std::optional<Eigen::Vector3f>& touch_mm, double now_s) {
  if (thinking_.valid()) {
    if (thinking_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
    guidance_ = thinking_.get();
    return true;
  }
  if (now_s < next_s_) return false;
  next_s_ = now_s + kIntervalS;
  if (blocks.empty() || !touch_mm) {
    blocks_.clear();
    return std::exchange(guidance_, {}).closed_share > 0;
  }
  const bool nothing_new =
      blocks == blocks_ && map.version == map_version_ && (*touch_mm - touch_mm_).norm() < kSamePlaceMm;
  if (nothing_new) return false;
  blocks_ = blocks, map_version_ = map.version, touch_mm_ = *touch_mm;
  thinking_ =
      std::async(std::launch::async, [border = border_, blocks, map, touch = *touch_mm, last = guidance_] {
        lower_thread_priority();
        border->update(blocks);
        return guide(*border, map, touch, last);
      });
  return false;
}

std::string progress_words(const Guidance& guidance) {
  if (guidance.closed_share <= 0) return "";
  std::string words = guidance.is_enough()
                          ? std::string("Closed all around")
                          : fmt::format("{:.0f} % closed", std::floor(100 * guidance.closed_share));
  if (const std::string drift = drift_words(guidance); !drift.empty())
    words += (guidance.is_enough() ? "; " : ", ") + drift;
  return words + ".";
}

std::string guidance_words(const Guidance& guidance) {
  if (guidance.closed_share <= 0) return "";
  if (guidance.target && guidance.target->reason == Guidance::Reason::drift)
    return "Roll along the arrow: the place there is known better.";
  return guidance.target ? "Roll along the arrow: the surface is open there."
                         : "Enough is there; Q stops and saves.";
}

}  // namespace gelslam::viewer::detail
