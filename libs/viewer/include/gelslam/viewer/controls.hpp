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

/// Everything a person can ask of any window.
enum class Action {
  close,
  help,
  screenshot,
  panels,  // of every window
  curvature,
  next_color,  // of a scene
  trajectory,
  pose_graph,
  not_in_mesh,
  show_all,  //
  pause,
  new_scan,
  diagnostics,
  follow,  // of a live scan
  play,
  step_back,
  step_on,  // of a saved run
  accept,
  previous,
  next,
  leave_out,
  accept_rest,
  left,
  right,
  up,  // of ball presses
  down,
  wider,
  narrower,
};

/// One row of a window's table: its keys, its button and its line in the help all come from here.
struct ActionRow {
  Action action;
  std::vector<int> keys;  ///< of GLFW
  std::string key;        ///< as people read them: "Q"
  std::string label;      ///< of its button; empty: it has none
  int group;              ///< a gap goes between groups of buttons
  int priority;           ///< buttons with the highest numbers go first where there is no room; 0 stays
  std::string help;       ///< empty: not listed
};

/// What several windows share: help, picture, and how a scene looks.
ActionRow common_row(Action action);

/// A line that says what was done, and goes by itself.
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

/// How a button looks now.
struct ButtonLook {
  bool shown = true;
  std::string label;
  Color ink = theme::kText;
};

/// What keys and buttons of a window do, without a pixel of how it looks. Times are the window's clock, s.
class Controls {
 public:
  explicit Controls(std::vector<ActionRow> rows) : rows_(std::move(rows)) {}
  virtual ~Controls() = default;
  Controls(const Controls&) = delete;
  Controls& operator=(const Controls&) = delete;

  /// A question takes every key; the help goes with any key, which then does what it says (but Esc).
  void press_key(int code, double now_s);
  void perform(Action action, double now_s);
  void answer(std::size_t index, double now_s);  ///< of the open question
  virtual ButtonLook button(const ActionRow& row) const { return {true, row.label, theme::kText}; }
  const std::vector<ActionRow>& rows() const { return rows_; }
  virtual std::vector<std::pair<std::string, std::string>> mouse_help() const { return {}; }

  void say(std::string text, double now_s) { add({std::move(text), false, now_s + 5}); }
  void complain(std::string text, double now_s, double seconds = 10) {
    add({std::move(text), true, now_s + seconds});
  }
  bool drop_old_toasts(double now_s);  ///< true when one went
  const std::deque<Toast>& toasts() const { return toasts_; }
  const std::optional<Question>& question() const { return question_; }
  bool shows_help() const { return shows_help_; }
  bool shows_panels() const { return shows_panels_; }
  bool wants_to_close() const { return wants_to_close_; }
  bool take_screenshot() { return std::exchange(screenshot_, false); }  ///< a request is handed out once

 protected:
  virtual void act(Action action, double now_s) = 0;  ///< what is not common to all windows; close, too
  void ask(Question question) { question_ = std::move(question); }
  void close() { wants_to_close_ = true; }

 private:
  void add(Toast toast);

  std::vector<ActionRow> rows_;
  std::deque<Toast> toasts_;
  std::optional<Question> question_;
  bool shows_help_ = false, shows_panels_ = true, wants_to_close_ = false, screenshot_ = false;
};

/// Those of a window that shows a scene.
class SceneControls : public Controls {
 public:
  SceneControls(std::vector<ActionRow> rows, const SceneStyle& style, std::vector<SceneColor> colors)
      : Controls(std::move(rows)), style_(style), colors_(std::move(colors)) {}

  const SceneStyle& style() const { return style_; }
  bool follows() const { return follows_; }  ///< the view turns to the touch, where there is one
  void set_follows(bool follows) { follows_ = follows; }
  bool take_show_all() { return std::exchange(show_all_, false); }
  ButtonLook button(const ActionRow& row) const override;
  std::vector<std::pair<std::string, std::string>> mouse_help() const override;

 protected:
  void act(Action action, double now_s) override;

 private:
  SceneStyle style_;
  std::vector<SceneColor> colors_;  ///< that mean something here
  bool show_all_ = false, follows_ = true;
};

/// The bar at the window's lower edge, as many buttons as there is room for, and what lies over the view:
/// messages, the help, a question.
void draw_action_bar(Ui& ui, const Box& bar, Controls& controls, double now_s);
void draw_messages(Ui& ui, const Box& view, const Controls& controls);
void draw_dialogs(Ui& ui, Controls& controls, double now_s);
inline constexpr double kBarHeight = 62;  ///< design pixels

}  // namespace gelslam::viewer
