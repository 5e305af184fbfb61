#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "gelslam/viewer/window_loop.hpp"
#include "scene/scene.hpp"

namespace gelslam::viewer::detail {

/// A window with a scene: the mouse rotates, moves and zooms the camera.
class SceneLoop : public WindowLoop {
 public:
  using WindowLoop::WindowLoop;

  SceneControls& controls() override = 0;

 protected:
  /// Returns a camera that sees everything.
  virtual OrbitCamera whole_view(const Viewport& viewport) const = 0;
  virtual const Scene& scene(std::size_t part) const = 0;
  /// Returns the parts of the view that are side by side, with the same camera.
  virtual std::vector<Viewport> parts(const Viewport& viewport) const { return {viewport}; }

  /// Glides to show everything, or to a point that was double-clicked. Returns true while it moves.
  bool move_camera(double dt_s);
  void show_all() { glide_ = Glide::all; }
  /// OrbitCamera::follow(); returns true while it moves.
  bool follow(const Pose& map_T_sensor, double dt_s);
  bool glide(const OrbitCamera& goal, double dt_s);  ///< Returns true while it moves.
  Viewport viewport() const;                         ///< Area of the view in the framebuffer.
  Box box_of(const Viewport& part) const;
  /// Returns the position of a point on the screen; nothing if it is behind the camera.
  std::optional<Eigen::Vector2f> on_screen(const Viewport& part, const Eigen::Vector3f& p_mm) const;
  /// Tints the touched surface that is not in the mesh if the style says so. `mesh` returns the
  /// reconstruction. It is called, and the surface that it lacks is computed, when that surface is first
  /// shown.
  void show_not_in_mesh(Scene& scene, const MapSnapshot& map, const std::function<Mesh()>& mesh);
  void draw_marks(Ui& ui, const std::optional<ColorLegend>& legend) const;

  OrbitCamera camera_;

 private:
  enum class Glide { none, all, place };
  struct Cursor {
    std::size_t part;
    Eigen::Vector2f at_px;  ///< Relative to the part.
    Viewport viewport;
  };
  Cursor cursor_in_part(const Eigen::Vector2f& at_px) const;

  void pressed(int button, const Eigen::Vector2f& at_px, double now_s) override;
  void moved(const Eigen::Vector2f& to_px) override;
  void released(int button) override;
  void scrolled(double steps, const Eigen::Vector2f& at_px) override;

  Glide glide_ = Glide::none;
  OrbitCamera goal_;
  std::optional<int> drag_button_;
  Eigen::Vector2f last_px_ = Eigen::Vector2f::Zero(), pressed_px_ = Eigen::Vector2f::Zero();
  double pressed_s_ = -1e9;
  bool knows_not_in_mesh_ = false;
};

}  // namespace gelslam::viewer::detail
