#pragma once

#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "gelslam/slam/live_session.hpp"
#include "gelslam/viewer/scene_style.hpp"
#include "live/keys.hpp"

namespace gelslam::viewer::detail {

enum class Dialog { none, help, confirm_stop, confirm_new_scan, confirm_leave, choose_export };

/// A line that says what was done, and goes by itself.
struct Toast {
  std::string text;
  bool trouble = false;
  double until_s = 0;
};

/// What a person can do with a live scan, without a pixel of how it looks: keys and buttons come in, calls to
/// the session and wishes for the window come out. Times are the window's clock, seconds.
class LiveControls {
 public:
  /// `keeps_run`: there is a run folder to save in.
  explicit LiveControls(LiveSession& session, bool keeps_run = true)
      : session_(session), keeps_run_(keeps_run) {}

  void press_key(int key, double now_s);  ///< GLFW code
  void perform(WindowAction action, double now_s);
  void ask_to_close();        ///< the window's own close button
  void accept(double now_s);  ///< the open dialog's main answer
  void refuse();
  void choose_format(const std::string& extension);  ///< "ply", "obj", "stl", of the export dialog
  void say(std::string text, double now_s);
  void complain(std::string text, double now_s);
  void drop_old_toasts(double now_s);

  Dialog dialog() const { return dialog_; }
  const std::deque<Toast>& toasts() const { return toasts_; }
  const SceneStyle& style() const { return style_; }
  bool follows() const { return follows_; }
  bool shows_panels() const { return shows_panels_; }
  bool wants_to_close() const { return wants_to_close_; }
  void stop_following() { follows_ = false; }  ///< the person turns the view

  /// Wishes that the window fulfils; each is handed out once.
  bool take_screenshot() { return std::exchange(screenshot_, false); }
  bool take_reset_view() { return std::exchange(reset_view_, false); }
  std::optional<std::string> take_export() { return std::exchange(export_, std::nullopt); }

 private:
  void pause_or_go_on(double now_s);
  void undo_last_trial(double now_s);
  void change_view(WindowAction action, double now_s);
  void add_toast(Toast toast);
  bool refuse_unless_scanning(const char* what, double now_s);

  LiveSession& session_;
  bool keeps_run_;
  Dialog dialog_ = Dialog::none;
  std::deque<Toast> toasts_;
  SceneStyle style_;
  bool follows_ = true, shows_panels_ = true, wants_to_close_ = false, screenshot_ = false,
       reset_view_ = false;
  std::optional<std::string> export_;
};

}  // namespace gelslam::viewer::detail
