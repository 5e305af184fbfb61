#pragma once

#include <exception>
#include <optional>
#include <vector>

#include "gelslam/viewer/label_window.hpp"
#include "label/label_controls.hpp"
#include "label/label_panels.hpp"
#include "ui/script_player.hpp"
#include "ui/window_host.hpp"

namespace gelslam::viewer::detail {

/// The window of `gelslam calibrate label`, frame by frame.
class LabelLoop {
 public:
  LabelLoop(LabelSession& session, const LabelWindowOptions& options);

  /// Until it is closed; saves at the end. Throws Error when something stays unsaved.
  void run();
  /// One turn at `now_s` of the window's clock. True when it drew.
  bool turn(double now_s);
  /// Draws a frame and reads it back.
  cv::Mat3b picture(double now_s);

  const LabelControls& controls() const { return controls_; }
  const std::vector<DrawnText>& texts() const { return texts_; }
  const LabelLayout& layout() const { return layout_; }
  WindowHost& host() { return host_; }
  std::size_t written() const { return controls_.written() + written_at_end_; }

 private:
  void save_after(const std::exception& failure);
  void handle_input(double now_s);
  void handle_button(const InputEvent& event);
  void show_press();
  void draw(double now_s);
  void fulfil_wishes(double now_s);

  LabelSession& session_;
  LabelWindowOptions options_;
  WindowHost host_;
  LabelControls controls_;
  ScriptPlayer player_;
  WindowTexture texture_;
  std::optional<std::pair<std::size_t, bool>>
      shown_;  // press, and whether its difference: as the texture has it
  double pointer_x_ = 0.0, pointer_y_ = 0.0;
  double drawn_s_ = 0.0;
  bool input_seen_ = false, draw_next_ = true, end_asked_ = false;
  std::size_t written_at_end_ = 0;
  LabelLayout layout_;
  std::vector<DrawnText> texts_;
  std::vector<Box> panels_;
};

}  // namespace gelslam::viewer::detail
