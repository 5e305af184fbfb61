// Turning points of a motion, which are kept as patches (not in the papers).
//
// Each tracked frame is compared with the previous frame and with the trial's last kKeyframes keyframes and
// patches: of its contact points, those count that the previous frame confirms and that no keyframe shows.
// The frame with most of these points is the candidate, if they are at least min_unseen of its contact. It
// becomes a patch when less than half of its points are still in view, when a new keyframe leaves at least
// the minimum of them unseen, or when the trial ends.

#include "gelslam/frontend/turning_points.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "gelslam/surface/surface.hpp"

namespace gelslam {
namespace {

// Keyframes that are compared. Older ones are elsewhere, or show a place to which the sensor has come back.
constexpr std::size_t kKeyframes = 6;

/// Tests which points of a trial lie in the contact of one frame.
class View {
 public:
  explicit View(const TurningPoints::Touch& touch)
      : surface_(*touch.surface), frame_T_trial_(touch.trial_T_frame.inverse()) {}

  bool shows(const Eigen::Vector3d& point_mm) const {
    return gelslam::shows(surface_, frame_T_trial_ * point_mm);
  }

 private:
  const Surface& surface_;
  Pose frame_T_trial_;
};

}  // namespace

void TurningPoints::begin_trial(const Touch& keyframe) {
  candidate_.reset();
  keyframes_.clear();
  keep(keyframe);
  before_ = keyframe;
}

std::optional<TurningPoints::Touch> TurningPoints::pass(const Touch& touch) {
  std::optional<Touch> left;
  if (candidate_) {
    const View view(touch);
    const auto& points = candidate_->unseen_mm;
    const auto in_view =
        std::count_if(points.begin(), points.end(), [&](const auto& p) { return view.shows(p); });
    // Less than half of these points are still in view, so the motion has turned away from them.
    if (2 * in_view < std::ssize(points)) left = release();
  }
  Candidate candidate{touch, unseen(touch), 0};
  const double contact_cells =
      static_cast<double>(touch.surface->contact_pixels) / (kContactPointStepPx * kContactPointStepPx);
  candidate.least = static_cast<std::size_t>(std::ceil(min_unseen_ * contact_cells));
  const std::size_t most = candidate_ ? candidate_->unseen_mm.size() : 0;
  if (candidate.unseen_mm.size() >= candidate.least && candidate.unseen_mm.size() > most)
    candidate_ = std::move(candidate);
  before_ = touch;
  return left;
}

std::optional<TurningPoints::Touch> TurningPoints::add_keyframe(const Touch& keyframe) {
  std::optional<Touch> before;
  if (candidate_) {
    const View view(keyframe);
    std::erase_if(candidate_->unseen_mm, [&](const auto& p) { return view.shows(p); });
    if (candidate_->unseen_mm.size() >= candidate_->least) before = release();
    candidate_.reset();
  }
  keep(keyframe);
  before_ = keyframe;
  return before;
}

std::optional<TurningPoints::Touch> TurningPoints::end_trial() {
  std::optional<Touch> last = release();
  keyframes_.clear();
  before_.reset();
  return last;
}

std::vector<Eigen::Vector3d> TurningPoints::unseen(const Touch& touch) const {
  std::vector<Eigen::Vector3d> points = coarse_contact_points_mm(*touch.surface);
  for (Eigen::Vector3d& point : points) point = touch.trial_T_frame * point;
  const View before(*before_);
  std::erase_if(points, [&](const auto& p) { return !before.shows(p); });
  for (const Touch& keyframe : keyframes_) {
    const View view(keyframe);
    std::erase_if(points, [&](const auto& p) { return view.shows(p); });
  }
  return points;
}

void TurningPoints::keep(const Touch& keyframe) {
  keyframes_.push_back(keyframe);
  if (keyframes_.size() > kKeyframes) keyframes_.pop_front();
}

std::optional<TurningPoints::Touch> TurningPoints::release() {
  if (!candidate_) return std::nullopt;
  const Touch touch = *candidate_;
  candidate_.reset();
  keep(touch);
  return touch;
}

}  // namespace gelslam
