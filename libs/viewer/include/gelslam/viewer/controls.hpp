#pragma once

#include <GLFW/glfw3.h>

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gelslam/viewer/scene_style.hpp"
#include "gelslam/viewer/ui.hpp"

namespace gelslam::viewer {

/// Everything that a user can request in any window.
enum class Action {
  close,
  help,
  screenshot,
  panels,  // In every window.
  curvature,
  next_color,  // In a scene.
  trajectory,
  pose_graph,
  not_in_mesh,
  show_all,  //
  pause,
  new_scan,
  diagnostics,
  follow,  // In a live scan.
  play,
  step_back,
  step_on,  // In a saved run.
  accept,
  previous,
  next,
  leave_out,
  accept_rest,
  left,
  right,
  up,  // In the labeling of ball presses.
  down,
  wider,
  narrower,
};

/// One row of a window's table of actions, which defines its keys, its button and its line in the help.
struct ActionRow {
  Action action;
  std::vector<int> keys;  ///< GLFW key codes.
  std::string key;        ///< Name of the key for the user: "Q".
  std::string label;      ///< Label of its button; empty if it has none.
  int group;              ///< A gap separates groups of buttons.
  /// If there is too little room, buttons with the highest number are removed first; 0 is never removed.
  int priority;
  std::string help;  ///< Empty if not listed in the help.
};

/// Returns the row of an action that several windows share: help, screenshot, and the look of a scene.
ActionRow common_row(Action action);

/// A message that disappears by itself.
struct Toast {
  std::string text;
  bool trouble = false;
  double until_s = 0;
};

struct Answer {
  std::string label;
  std::vector<int> keys;
  std::string key;
  Color ink = theme::kText;
  std::function<void(double now_s)> run;
};
struct Question {
  std::string title, sentence;
  std::vector<Answer> answers;
};

/// Current look of a button.
struct ButtonLook {
  bool shown = true;
  std::string label;
  Color ink = theme::kText;
};

/// Behavior of a window's keys and buttons, independent of how they are drawn. Times are in s of the window's
/// clock.
class Controls {
 public:
  explicit Controls(std::vector<ActionRow> rows) : rows_(std::move(rows)) {}
  virtual ~Controls() = default;
  Controls(const Controls&) = delete;
  Controls& operator=(const Controls&) = delete;

  /// Handles a key. An open question takes every key. An open help closes with any key, which then has its
  /// usual effect (except Esc).
  void press_key(int code, double now_s);
  void perform(Action action, double now_s);
  void answer(std::size_t index, double now_s);  ///< Answers the open question.
  virtual ButtonLook button(const ActionRow& row) const { return {true, row.label, theme::kText}; }
  const std::vector<ActionRow>& rows() const { return rows_; }
  virtual std::vector<std::pair<std::string, std::string>> mouse_help() const { return {}; }

  void say(std::string text, double now_s) { add({std::move(text), false, now_s + 5}); }
  void complain(std::string text, double now_s, double seconds = 10) {
    add({std::move(text), true, now_s + seconds});
  }
  bool drop_old_toasts(double now_s);  ///< Returns true if one was removed.
  const std::deque<Toast>& toasts() const { return toasts_; }
  const std::optional<Question>& question() const { return question_; }
  bool shows_help() const { return shows_help_; }
  bool shows_panels() const { return shows_panels_; }
  bool wants_to_close() const { return wants_to_close_; }
  bool take_screenshot() { return std::exchange(screenshot_, false); }  ///< Returns each request only once.

 protected:
  /// Performs actions that are not common to all windows, and close.
  virtual void act(Action action, double now_s) = 0;
  void ask(Question question) { question_ = std::move(question); }
  void close() { wants_to_close_ = true; }

 private:
  void add(Toast toast);

  std::vector<ActionRow> rows_;
  std::deque<Toast> toasts_;
  std::optional<Question> question_;
  bool shows_help_ = false, shows_panels_ = true, wants_to_close_ = false, screenshot_ = false;
};

/// Controls of a window that shows a scene.
class SceneControls : public Controls {
 public:
  SceneControls(std::vector<ActionRow> rows, const SceneStyle& style, std::vector<SceneColor> colors)
      : Controls(std::move(rows)), style_(style), colors_(std::move(colors)) {}

  const SceneStyle& style() const { return style_; }
  bool follows() const { return follows_; }  ///< True if the view follows the touch, if there is one.
  void set_follows(bool follows) { follows_ = follows; }
  bool take_show_all() { return std::exchange(show_all_, false); }
  ButtonLook button(const ActionRow& row) const override;
  std::vector<std::pair<std::string, std::string>> mouse_help() const override;

 protected:
  void act(Action action, double now_s) override;

 private:
  SceneStyle style_;
  std::vector<SceneColor> colors_;  ///< Colors that are available here.
  bool show_all_ = false, follows_ = true;
};

/// Draw the bar at the lower edge of the window with as many buttons as fit, and what is above the view:
/// messages, the help, a question.
void draw_action_bar(Ui& ui, const Box& bar, Controls& controls, double now_s);
void draw_messages(Ui& ui, const Box& view, const Controls& controls);
void draw_dialogs(Ui& ui, Controls& controls, double now_s);
inline constexpr double kBarHeight = 62;  ///< In design pixels.

}  // namespace gelslam::viewer
