#pragma once

#include <optional>
#include <vector>

#include "gelslam/viewer/scene.hpp"
#include "live/status_text.hpp"
#include "live/window_controls.hpp"
#include "live/window_mesh.hpp"
#include "ui/window_host.hpp"
#include "ui/window_texture.hpp"

namespace gelslam::viewer::detail {

/// The session as a scene: takes what is new from it, moves the camera, draws. Needs the window's context to
/// be current.
class WindowView {
 public:
  /// True when something has come that is to be drawn.
  bool take_news(LiveSession& session, double now_s);

  /// The mouse on the view (positions within it), and the camera's glide. `viewport` is the view's part of
  /// the window.
  void drag(int button, const Eigen::Vector2f& movement_px, const Viewport& viewport);
  void zoom(double steps, const Eigen::Vector2f& cursor_px, const Viewport& viewport);
  void center_on(const Eigen::Vector2f& cursor_px, const Viewport& viewport);
  void show_all();
  void show_all_at_once(const Viewport& viewport);
  /// Moves the camera for `dt_s`; true while it is on its way.
  bool advance(double dt_s, bool follows, const Viewport& viewport);

  void draw(const Viewport& viewport, const SceneStyle& style);

  double mm_per_px(const Viewport& viewport) const {
    return camera_.mm_per_px(camera_.distance_mm(), viewport);
  }
  std::optional<ColorLegend> legend(const SceneStyle& style) const { return scene_.legend(style); }
  const WindowMesh& mesh() const { return mesh_; }
  const WindowTexture& tactile() const { return tactile_; }
  const WindowTexture& normals() const { return normals_; }
  const LiveTouch* touch() const { return touch_.get(); }
  void set_outline(const cv::Vec3b& bgr) { outline_bgr_ = bgr; }

 private:
  struct Sample {  // of the sensor's way
    int keyframe;
    int trial;
    Pose keyframe_T_frame;
  };

  void take_touch(const std::shared_ptr<const LiveTouch>& touch);
  void place_touch(double now_s);
  void rebuild_trajectory();

  Scene scene_;
  OrbitCamera camera_;
  WindowMesh mesh_;
  WindowTexture tactile_, normals_;
  cv::Vec3b outline_bgr_{255, 255, 255};
  std::shared_ptr<const LiveTouch> touch_;
  std::shared_ptr<const MapSnapshot> map_;
  std::optional<TouchPatch> placed_;
  double placed_s_ = 0;
  bool shows_all_ = false, trajectory_is_old_ = false;
  std::vector<Sample> way_;
};

}  // namespace gelslam::viewer::detail
