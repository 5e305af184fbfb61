#include "gelslam/frontend/turning_points.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gelslam {
namespace {

constexpr int kGridStepPx = 8;
constexpr std::size_t kKeyframes = 6;  // further back, the sensor was elsewhere or comes as to any seen place
constexpr double kLeft = 0.5;  // of what was unseen is out of view: the motion has turned away from it

/// The contact's points on a coarse grid, in the trial's frame.
std::vector<Eigen::Vector3d> contact_points(const TurningPoints::Touch& touch) {
  const Surface& surface = *touch.surface;
  const double center_u = 0.5 * surface.contact.cols - 0.5, center_v = 0.5 * surface.contact.rows - 0.5;
  std::vector<Eigen::Vector3d> points;
  for (int v = kGridStepPx / 2; v < surface.contact.rows; v += kGridStepPx)
    for (int u = kGridStepPx / 2; u < surface.contact.cols; u += kGridStepPx)
      if (surface.contact(v, u))
        points.push_back(touch.trial_T_frame * Eigen::Vector3d((u - center_u) * surface.pixel_pitch_mm,
                                                               (v - center_v) * surface.pixel_pitch_mm,
                                                               static_cast<double>(surface.height_mm(v, u))));
  return points;
}

/// Whether a point of the trial lies in a touch's contact, close to its height: not on the object's other
/// side.
class View {
 public:
  explicit View(const TurningPoints::Touch& touch)
      : surface_(*touch.surface), frame_T_trial_(touch.trial_T_frame.inverse()) {}

  bool shows(const Eigen::Vector3d& point_mm) const {
    constexpr double kHeightToleranceMm = 0.5;
    const Eigen::Vector3d p = frame_T_trial_ * point_mm;
    const double u = p.x() / surface_.pixel_pitch_mm + 0.5 * surface_.contact.cols - 0.5;
    const double v = p.y() / surface_.pixel_pitch_mm + 0.5 * surface_.contact.rows - 0.5;
    if (!(u >= 0 && v >= 0 && u <= surface_.contact.cols - 1 && v <= surface_.contact.rows - 1)) return false;
    const int column = static_cast<int>(std::lround(u)), row = static_cast<int>(std::lround(v));
    return surface_.contact(row, column) &&
           std::abs(p.z() - static_cast<double>(surface_.height_mm(row, column))) < kHeightToleranceMm;
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
}

std::optional<TurningPoints::Touch> TurningPoints::pass(const Touch& touch) {
  std::optional<Touch> left;
  if (candidate_) {
    const View view(touch);
    const auto& points = candidate_->unseen_mm;
    const auto in_view =
        std::count_if(points.begin(), points.end(), [&](const auto& p) { return view.shows(p); });
    if (static_cast<double>(in_view) < (1.0 - kLeft) * static_cast<double>(points.size())) left = release();
  }
  Candidate candidate{touch, unseen(touch), 0};
  const double contact_cells =
      static_cast<double>(touch.surface->contact_pixels) / (kGridStepPx * kGridStepPx);
  candidate.least = static_cast<std::size_t>(std::ceil(min_unseen_ * contact_cells));
  const std::size_t most = candidate_ ? candidate_->unseen_mm.size() : 0;
  if (candidate.unseen_mm.size() >= candidate.least && candidate.unseen_mm.size() > most)
    candidate_ = std::move(candidate);
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
  return before;
}

std::optional<TurningPoints::Touch> TurningPoints::end_trial() {
  std::optional<Touch> last = release();
  keyframes_.clear();
  return last;
}

std::vector<Eigen::Vector3d> TurningPoints::unseen(const Touch& touch) const {
  std::vector<Eigen::Vector3d> points = contact_points(touch);
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
