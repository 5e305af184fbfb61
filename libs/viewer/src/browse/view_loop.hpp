#pragma once

#include <optional>
#include <string>
#include <vector>

#include "browse/view_panels.hpp"
#include "gelslam/viewer/view_stage.hpp"
#include "gelslam/viewer/view_window.hpp"
#include "ui/script_player.hpp"
#include "ui/window_host.hpp"

namespace gelslam::viewer::detail {

/// The window of `gelslam view`, frame by frame.
class ViewLoop {
 public:
  ViewLoop(ViewContent first, std::optional<ViewContent> second, const ViewWindowOptions& options);

  void run();
  /// One turn at `now_s` of the window's clock. True when it drew.
  bool turn(double now_s);
  /// Draws a frame and reads it back.
  cv::Mat3b picture(double now_s);

  const ViewControls& controls() const { return controls_; }
  const std::vector<DrawnText>& texts() const { return texts_; }
  const ViewLayout& layout() const { return layout_; }
  WindowHost& host() { return host_; }

 private:
  void handle_input(double now_s);
  void handle_pointer(const Eigen::Vector2f& pointer_px);
  void handle_button(const InputEvent& event, double now_s);
  void show_time();
  bool move_camera(double dt_s);
  void draw(double now_s);
  ViewFrame gather(double now_s) const;
  void fulfil_wishes(double now_s);
  Viewport view_viewport() const;
  bool on_panel(const Eigen::Vector2f& pixel) const;
  /// Cursor position within the part it is over, and that part.
  Eigen::Vector2f in_part(const Eigen::Vector2f& pixel, Viewport& part) const;

  ViewWindowOptions options_;
  WindowHost host_;
  ViewStage stage_;
  ViewControls controls_;
  ScriptPlayer player_;
  OrbitCamera camera_;
  std::optional<OrbitCamera> goal_;     // where the camera glides to
  std::optional<double> shown_time_s_;  // as the stage knows it
  bool camera_is_set_ = false, works_ = false, input_seen_ = false, draw_next_ = true;
  bool drags_slider_ = false;
  std::optional<int> drag_button_;
  Eigen::Vector2f pointer_px_ = Eigen::Vector2f::Zero(), pressed_px_ = Eigen::Vector2f::Zero();
  double drawn_s_ = 0, pressed_s_ = -1e9, message_until_s_ = 0;
  std::string message_;
  ViewLayout layout_;
  std::vector<DrawnText> texts_;
  std::vector<Box> panels_;
};

}  // namespace gelslam::viewer::detail
