#include "live/rig_view.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gelslam::slam::detail {
namespace {

constexpr double kShownPerS = 5;
constexpr double kMaxPairGapS = 0.02;       // half a frame: what moved meanwhile is not seen in a window
constexpr std::size_t kFirstEstimate = 15;  // constraints, 3 s
constexpr double kLeverMm = 10;             // from the middle of a sensor to its border
constexpr double kAgreeMm = 1, kVisibleMm = 0.1;  // of two estimates; of a place

double distance_mm(const Pose& a, const Pose& b) {
  const Vector6d error = se3_log(a.inverse() * b);
  return std::hypot(kLeverMm * error.head<3>().norm(), error.tail<3>().norm());
}

bool has_contact(const std::shared_ptr<const LiveTouch>& touch) {
  return touch && (touch->status == TrackStatus::tracked || touch->status == TrackStatus::lost);
}

/// Where a sensor is in its map's shown component.
std::optional<Pose> place_of(int keyframe, const Pose& keyframe_T_sensor, const MapSnapshot& map) {
  const MapSnapshot::Node* node = map.find(keyframe);
  if (node == nullptr || node->component != map.shown_component) return std::nullopt;
  return node->component_T_keyframe * keyframe_T_sensor;
}

}  // namespace

RigView::RigView(const std::optional<RigPose>& known) : next_estimate_at_(kFirstEstimate) {
  if (known) first_T_second_ = known->first_T_second;
}

void RigView::learn(const RigNews& news) {
  collect(news);
  if (!first_T_second_ && constraints_.size() >= next_estimate_at_) find_rig(news);
}

void RigView::show(const RigNews& news) {
  const bool map_changed = news.map != news_.map;
  news_ = news;
  if (place_second() || map_changed) join_maps();
  shows_second_ = !has_contact(news.touch[0]) && has_contact(news.touch[1]);
  const auto& source = news.touch[shows_second_ ? 1 : 0];
  if (source == std::exchange(touch_source_, source)) return;
  touch_ = source;
  if (!shows_second_) return;
  auto touch = std::make_shared<LiveTouch>(*source);
  if (touch->keyframe >= 0) touch->keyframe += kSecond;
  if (touch->trial >= 0) touch->trial += kSecond;
  touch_ = std::move(touch);
}

/// Where both were tracked at one time.
void RigView::collect(const RigNews& news) {
  const auto &first = news.touch[0], &second = news.touch[1];
  if (!first || !second || first->keyframe < 0 || second->keyframe < 0) return;
  if (std::abs(first->time_s - second->time_s) > kMaxPairGapS) return;
  if (first->time_s < constrained_s_ + 1 / kShownPerS) return;
  constrained_s_ = first->time_s;
  constraints_.push_back(
      {first->keyframe, second->keyframe + kSecond, first->keyframe_T_frame, second->keyframe_T_frame});
}

/// Two estimates that agree, the second from twice as many constraints.
void RigView::find_rig(const RigNews& news) {
  next_estimate_at_ = 2 * constraints_.size();
  PoseGraphSolution solution;
  for (const int sensor : {0, 1})
    for (const MapSnapshot::Node& node : news.map[static_cast<std::size_t>(sensor)]->nodes) {
      solution.component_T_node[node.keyframe + sensor * kSecond] = node.component_T_keyframe;
      solution.component_of_node[node.keyframe + sensor * kSecond] = node.component + sensor * kSecond;
    }
  const std::optional<Pose> estimate = rig_from_motions(constraints_, solution);
  if (estimate && last_estimate_ && distance_mm(*estimate, *last_estimate_) < kAgreeMm)
    first_T_second_ = estimate;
  last_estimate_ = estimate;
}

/// By what both touch now. It stays where it is until that makes a visible difference: false.
bool RigView::place_second() {
  if (!first_T_second_ || constraints_.empty()) return false;
  const RigConstraint& now = constraints_.back();
  const auto first = place_of(now.first_keyframe, now.first_keyframe_T_sensor, *news_.map[0]),
             second = place_of(now.second_keyframe - kSecond, now.second_keyframe_T_sensor, *news_.map[1]);
  if (!first || !second) return false;
  const Pose place = normalized(*first * *first_T_second_ * second->inverse());
  if (first_map_T_second_map_ && distance_mm(place, *first_map_T_second_map_) < kVisibleMm) return false;
  first_map_T_second_map_ = place;
  return true;
}

void RigView::join_maps() {
  const MapSnapshot& second = *news_.map[1];
  auto map = std::make_shared<MapSnapshot>(*news_.map[0]);
  map->version = map_->version + 1;
  for (MapSnapshot::Node node : second.nodes) {
    const bool placed = first_map_T_second_map_ && node.component == second.shown_component;
    node.keyframe += kSecond;
    node.trial += kSecond;
    if (placed) node.component_T_keyframe = *first_map_T_second_map_ * node.component_T_keyframe;
    node.component = placed ? map->shown_component : node.component + kSecond;
    map->nodes.push_back(std::move(node));
  }
  for (MapSnapshot::Edge edge : second.edges) {
    edge.from += kSecond;
    edge.to += kSecond;
    map->edges.push_back(edge);
  }
  map_ = std::move(map);
}

}  // namespace gelslam::slam::detail
