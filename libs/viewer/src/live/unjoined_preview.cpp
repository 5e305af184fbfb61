#include "live/unjoined_preview.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr float kGapMm = 3;  ///< Distance between the map and the component.

Eigen::AlignedBox3f box_of(const TouchMesh& mesh) {
  Eigen::AlignedBox3f box;
  for (const TouchMesh::Vertex& vertex : mesh.vertices) box.extend(vertex.position_mm);
  return box;
}

}  // namespace

bool UnjoinedPreview::follow(const MapSnapshot& map, const FrameReport* touch,
                             const std::optional<MapPlace>& place) {
  const bool touching = place && touch->surface;
  anchor_T_touch_.reset();
  if (is_apart()) {
    const MapSnapshot::Node* anchor = map.find(anchor_);
    // The shown map contains it now, or it was withdrawn.
    if (anchor == nullptr || anchor->component == map.shown_component) *this = {};
  }
  const MapSnapshot::Node* first = touching ? map.find(place->component) : nullptr;
  const bool apart = first != nullptr && place->component != map.shown_component;
  // If tracking was lost again before the component was joined, the newest component is shown.
  const bool begins = apart && (!is_apart() || map.find(anchor_)->component != place->component);
  if (begins) {
    *this = {};
    anchor_ = first->keyframe;
  }
  if (!is_apart()) return false;
  const bool changed = grow(map, *map.find(anchor_)) || begins;
  if (touching) half_width_mm_ = 0.5 * touch->surface->contact.cols * touch->surface->pixel_pitch_mm;
  if (const MapSnapshot::Node* anchor = map.find(anchor_); touching && anchor->component == place->component)
    anchor_T_touch_ = anchor->component_T_keyframe.inverse() * place->map_T_frame.pose;
  return changed;
}

/// Takes the keyframes of the component. Returns true if there are new ones, or if their poses have changed.
bool UnjoinedPreview::grow(const MapSnapshot& map, const MapSnapshot::Node& anchor) {
  const Pose anchor_T_component = anchor.component_T_keyframe.inverse();
  std::map<int, Pose> poses;
  bool changed = false;
  for (const MapSnapshot::Node& node : map.nodes) {
    if (node.component != anchor.component || !node.surface) continue;
    const Pose pose = anchor_T_component * node.component_T_keyframe;
    const auto old = anchor_T_keyframe_.find(node.keyframe);
    changed |= old == anchor_T_keyframe_.end() || !old->second.isApprox(pose, 1e-4);
    poses.emplace(node.keyframe, pose);
    if (!patches_.contains(node.keyframe))
      patches_[node.keyframe] = make_touch_mesh(*node.surface.get(), map.gradient_scale.mean());
  }
  changed |= poses.size() != anchor_T_keyframe_.size();
  anchor_T_keyframe_ = std::move(poses);
  if (!changed) return false;
  mesh_ = {};
  for (const auto& [keyframe, pose] : anchor_T_keyframe_) {
    const TouchMesh& patch = patches_.at(keyframe);
    const auto first = static_cast<int>(mesh_.vertices.size());
    const Eigen::Isometry3f moved = pose.cast<float>();
    for (const TouchMesh::Vertex& v : patch.vertices)
      mesh_.vertices.push_back({moved * v.position_mm, moved.linear() * v.normal, v.inside});
    for (const Eigen::Vector3i& t : patch.triangles) mesh_.triangles.emplace_back(t.array() + first);
  }
  return true;
}

void UnjoinedPreview::place_beside(const Eigen::AlignedBox3f& map_box_mm, const OrbitCamera& camera) {
  const Eigen::Matrix3f axes = camera.map_R_camera();
  const Eigen::AlignedBox3f own = box_of(mesh_);
  // Oriented as the sensor sees it: x to the right, y down, z away from the viewer.
  Pose pose = Pose::Identity();
  pose.linear() = (axes * Eigen::Vector3f(1, -1, -1).asDiagonal()).cast<double>();
  Eigen::Vector3f place = camera.center_mm();
  if (!map_box_mm.isEmpty()) {
    const float map_reach = 0.5F * axes.col(0).cwiseAbs().dot(map_box_mm.sizes());
    place = map_box_mm.center() + (map_reach + kGapMm + static_cast<float>(half_width_mm_)) * axes.col(0);
  }
  const Eigen::Vector3d middle =
      own.isEmpty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(own.center().cast<double>());
  pose.translation() = place.cast<double>() - pose.linear() * middle;
  map_T_anchor_ = pose;
}

std::optional<Pose> UnjoinedPreview::map_T_touch() const {
  if (!map_T_anchor_ || !anchor_T_touch_) return std::nullopt;
  return *map_T_anchor_ * *anchor_T_touch_;
}

Eigen::AlignedBox3f UnjoinedPreview::box_mm() const {
  Eigen::AlignedBox3f own = box_of(mesh_);
  if (!map_T_anchor_ || own.isEmpty()) return {};
  if (anchor_T_touch_) {  // Includes the sensor's outline.
    const Eigen::Vector3f middle = anchor_T_touch_->translation().cast<float>();
    const Eigen::Vector3f reach(static_cast<float>(half_width_mm_), static_cast<float>(half_width_mm_), 0);
    own.extend(middle + reach).extend(middle - reach);
  }
  return own.transformed(map_T_anchor_->cast<float>());
}

}  // namespace gelslam::viewer::detail
