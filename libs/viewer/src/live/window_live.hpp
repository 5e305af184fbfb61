#pragma once

#include <future>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/viewer/window.hpp"
#include "live/window_controls.hpp"
#include "live/window_view.hpp"
#include "ui/panels.hpp"
#include "ui/script_player.hpp"
#include "ui/window_host.hpp"

namespace gelslam::viewer::detail {

/// The live window, frame by frame: input, news from the session, drawing, and what was asked for.
class LiveWindow {
 public:
  LiveWindow(LiveSession& session, const WindowOptions& options);
  ~LiveWindow() { host_.make_current(); }  // what was drawn with is freed there
  LiveWindow(const LiveWindow&) = delete;
  LiveWindow& operator=(const LiveWindow&) = delete;

  /// Until the person or the script closes it.
  void run();
  /// One turn at `now_s` of the window's clock; `draw_anyway` even if nothing has changed. True when it drew.
  bool turn(double now_s, bool draw_anyway = false);
  bool wants_to_close() const {
    return controls_.wants_to_close() || player_.wants_to_quit() || closes_by_itself();
  }
  void show_all_at_once();
  /// Draws a frame and reads it back.
  cv::Mat3b picture(double now_s);

  WindowHost& host() { return host_; }
  LiveControls& controls() { return controls_; }
  const std::vector<DrawnText>& texts() const { return texts_; }
  const PanelLayout& layout() const { return layout_; }

 private:
  void handle_input(double now_s);
  void handle_pointer(const InputEvent& event);
  void handle_button(const InputEvent& event, double now_s);
  void look_at_figures(double now_s);
  LiveFrame gather(double now_s) const;
  void draw(double now_s);
  SceneStyle style_now() const;  ///< what the person chose, as far as the phase allows
  void fulfil_wishes(double now_s);
  void tell(const ExportOutcome& outcome, double now_s);
  bool closes_by_itself() const;
  bool on_panel(double x, double y) const;
  Viewport view_viewport() const;

  struct Drag {
    int button;
    Eigen::Vector2f last_px;
  };

  LiveSession& session_;
  WindowOptions options_;
  WindowHost host_;
  WindowView view_;
  LiveControls controls_;
  ScriptPlayer player_;
  LiveStatus status_;
  std::vector<StageStatistics> stages_;
  std::vector<ResultFile> results_;
  double disk_free_bytes_ = -1;
  double figures_s_ = -1e9, drawn_s_ = -1e9, pressed_s_ = -1e9;
  Eigen::Vector2f pointer_px_ = Eigen::Vector2f::Zero(), pressed_px_ = Eigen::Vector2f::Zero();
  std::optional<Drag> drag_;
  PanelLayout layout_;
  std::vector<DrawnText> texts_;
  std::vector<Box> panels_;
  std::future<ExportOutcome> export_;
  bool input_seen_ = false;
};

}  // namespace gelslam::viewer::detail
