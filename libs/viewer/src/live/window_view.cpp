#include "live/window_view.hpp"

#include <GLFW/glfw3.h>

#include "ui/tactile_view.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr int picture_width_px = 640;  // more than the panel shows, for large screens
/// A touch whose keyframe is not on the map yet keeps its last place for so long: the map comes a little
/// later.
constexpr double patience_s = 1.0;

bool nearly_there(const OrbitCamera& a, const OrbitCamera& b) {
  const float near_mm = 1e-3F * b.distance_mm();
  return (a.center_mm() - b.center_mm()).norm() < near_mm &&
         std::abs(a.distance_mm() - b.distance_mm()) < near_mm &&
         (a.map_R_camera() - b.map_R_camera()).norm() < 1e-3F;
}

}  // namespace

bool WindowView::take_news(LiveSession& session, double now_s) {
  bool news = false;
  if (MeshChanges changes = session.take_mesh_changes(); changes.cleared || !changes.blocks.empty()) {
    scene_.update(changes);
    mesh_.update(std::move(changes));
    news = true;
  }
  const auto touch = session.touch();
  if (touch != touch_) {
    take_touch(touch);
    news = true;
  }
  const auto map = session.map();
  if (map != map_) {
    if (map->nodes.empty()) way_.clear();  // a new scan: its ids begin anew
    map_ = map;
    scene_.set_map(*map_);
    trajectory_is_old_ = true;
    news = true;
  }
  if (news) place_touch(now_s);
  return news;
}

void WindowView::take_touch(const std::shared_ptr<const LiveTouch>& touch) {
  if (touch_ && touch && touch->index < touch_->index) way_.clear();
  touch_ = touch;
  if (!touch_) return;
  if (const cv::Mat3b picture = tactile_picture(*touch_, picture_width_px, outline_bgr_); !picture.empty())
    tactile_.set(picture);
  if (touch_->surface)
    if (const cv::Mat3b picture = normal_picture(*touch_->surface, picture_width_px); !picture.empty())
      normals_.set(picture);
  if (touch_->keyframe >= 0) {
    const MapSnapshot::Node* node = map_ ? map_->find(touch_->keyframe) : nullptr;
    way_.push_back({touch_->keyframe, node ? node->trial : -1, touch_->keyframe_T_frame});
  }
}

void WindowView::place_touch(double now_s) {
  const MapSnapshot::Node* node = touch_ && touch_->keyframe >= 0 ? map_->find(touch_->keyframe) : nullptr;
  const bool touching = touch_ && touch_->keyframe >= 0 && touch_->surface;
  const bool apart = node != nullptr && node->component != map_->shown_component;
  if (touching && node != nullptr && !apart) {
    placed_ = TouchPatch{touch_->surface, node->component_T_keyframe * touch_->keyframe_T_frame,
                         map_->gradient_scale.mean()};
    placed_s_ = now_s;
  } else if (!touching || apart || now_s - placed_s_ > patience_s) {
    placed_.reset();
  }
  scene_.set_touch(placed_);
}

void WindowView::rebuild_trajectory() {
  std::vector<std::vector<Pose>> pieces;
  int trial = -1;
  for (const Sample& sample : way_) {
    const MapSnapshot::Node* node = map_->find(sample.keyframe);
    if (node == nullptr || node->component != map_->shown_component) continue;
    if (pieces.empty() || node->trial != trial) pieces.emplace_back();
    trial = node->trial;
    pieces.back().push_back(node->component_T_keyframe * sample.keyframe_T_frame);
  }
  scene_.set_trajectory(pieces);
  trajectory_is_old_ = false;
}

void WindowView::drag(int button, const Eigen::Vector2f& movement_px, const Viewport& viewport) {
  shows_all_ = false;
  if (button == GLFW_MOUSE_BUTTON_LEFT)
    camera_.orbit(movement_px, viewport);
  else
    camera_.pan(movement_px, viewport);
}

void WindowView::zoom(double steps, const Eigen::Vector2f& cursor_px, const Viewport& viewport) {
  shows_all_ = false;
  camera_.zoom(steps, cursor_px, viewport);
}

void WindowView::center_on(const Eigen::Vector2f& cursor_px, const Viewport& viewport) {
  if (const auto place = scene_.pick(camera_.pick_ray(cursor_px, viewport))) camera_.look_at(*place);
}

void WindowView::show_all() { shows_all_ = true; }

void WindowView::show_all_at_once(const Viewport& viewport) {
  scene_.finish_details();
  camera_.fit(scene_.bounds_mm(), viewport);
}

bool WindowView::advance(double dt_s, bool follows, const Viewport& viewport) {
  if (shows_all_) {
    const OrbitCamera goal = camera_.fitted(scene_.bounds_mm(), viewport);
    camera_.glide_to(goal, dt_s);
    shows_all_ = !nearly_there(camera_, goal);
    return true;
  }
  if (!follows || !placed_) return false;
  const OrbitCamera before = camera_;
  camera_.follow(placed_->map_T_sensor, dt_s);
  return !nearly_there(before, camera_);
}

void WindowView::draw(const Viewport& viewport, const SceneStyle& style) {
  if (style.trajectory && trajectory_is_old_) rebuild_trajectory();
  scene_.draw(camera_, viewport, style);
}

}  // namespace gelslam::viewer::detail
