#include "live/window_controls.hpp"

#include <GLFW/glfw3.h>

#include <utility>

#include "scene/scene_actions.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double toast_s = 5, complaint_s = 10;
constexpr std::size_t max_toasts = 4;

const char* name_of(SceneColor color) {
  switch (color) {
    case SceneColor::plain:
      return "plain";
    case SceneColor::confidence:
      return "confidence";
    case SceneColor::height:
      return "height";
    case SceneColor::keyframe:
      return "keyframe";
    case SceneColor::distance:
      return "distance";
  }
  return "";
}

/// The distance to another mesh is nothing a live scan knows.
SceneColor live_color_after(SceneColor color) {
  using enum SceneColor;
  return color_after(color, {plain, confidence, height, keyframe});
}

}  // namespace

void LiveControls::press_key(int key, double now_s) {
  const auto action = action_of_key(window_keys(), key);
  if (dialog_ == Dialog::none) {
    if (action) perform(*action, now_s);
    return;
  }
  const bool accepts = key == GLFW_KEY_ENTER || key == GLFW_KEY_KP_ENTER || key == GLFW_KEY_Y;
  if (dialog_ == Dialog::help) {
    dialog_ = Dialog::none;  // any key, and it does what it says
    if (action && *action != WindowAction::help && key != GLFW_KEY_ESCAPE) perform(*action, now_s);
  } else if (accepts) {
    accept(now_s);
  } else if (dialog_ == Dialog::choose_export &&
             (key == GLFW_KEY_P || key == GLFW_KEY_O || key == GLFW_KEY_S)) {
    choose_format(key == GLFW_KEY_P ? "ply" : key == GLFW_KEY_O ? "obj" : "stl");
  } else if (key == GLFW_KEY_ESCAPE || (dialog_ != Dialog::choose_export && key == GLFW_KEY_N)) {
    refuse();
  }
}

void LiveControls::perform(WindowAction action, double now_s) {
  using enum WindowAction;
  switch (action) {
    case pause:
      return pause_or_go_on(now_s);
    case undo_trial:
      return undo_last_trial(now_s);
    case new_scan:
      if (!refuse_unless_scanning("start a new scan", now_s)) dialog_ = Dialog::confirm_new_scan;
      return;
    case save:
      if (refuse_unless_scanning("save", now_s)) return;
      if (!keeps_run_)
        return complain("There is no folder to save in: start with -o FOLDER, or export the mesh (E).",
                        now_s);
      session_.save_now();
      return say("Saving what there is; the scan goes on.", now_s);
    case stop:
      return ask_to_close();
    case screenshot:
      screenshot_ = true;
      return;
    case export_mesh:
      dialog_ = Dialog::choose_export;
      return;
    case reset_view:
      follows_ = false;
      reset_view_ = true;
      return;
    case panels:
      shows_panels_ = !shows_panels_;
      return;
    case help:
      dialog_ = dialog_ == Dialog::help ? Dialog::none : Dialog::help;
      return;
    default:
      return change_view(action, now_s);
  }
}

void LiveControls::change_view(WindowAction action, double now_s) {
  using enum WindowAction;
  if (change_look(style_, action)) return;
  switch (action) {
    case next_color:
      style_.color = live_color_after(style_.color);
      return say(std::string("Colors: ") + name_of(style_.color), now_s);
    case follow:
      follows_ = !follows_;
      return say(follows_ ? "The view follows the touch." : "The view stays where it is.", now_s);
    default:
      return;
  }
}

bool LiveControls::refuse_unless_scanning(const char* what, double now_s) {
  const LivePhase phase = session_.status().phase;
  if (phase != LivePhase::finishing && phase != LivePhase::finished) return false;
  complain(std::string("The scan is over: too late to ") + what + ".", now_s);
  return true;
}

void LiveControls::pause_or_go_on(double now_s) {
  if (refuse_unless_scanning("pause", now_s)) return;
  const bool paused = session_.status().phase == LivePhase::paused;
  session_.set_paused(!paused);
  say(paused ? "Going on." : "Paused.", now_s);
}

void LiveControls::undo_last_trial(double now_s) {
  if (refuse_unless_scanning("undo", now_s)) return;
  if (session_.status().trials == 0) return complain("There is no trial to undo.", now_s);
  session_.undo_last_trial();
  say("The last trial is taken back.", now_s);
}

void LiveControls::ask_to_close() {
  switch (session_.status().phase) {
    case LivePhase::finished:
      wants_to_close_ = true;
      return;
    case LivePhase::finishing:
      dialog_ = Dialog::confirm_leave;
      return;
    default:
      dialog_ = Dialog::confirm_stop;
  }
}

void LiveControls::accept(double now_s) {
  switch (std::exchange(dialog_, Dialog::none)) {
    case Dialog::confirm_stop:
      session_.stop();
      return say("Stopping: loops are closed, and the mesh is made.", now_s);
    case Dialog::confirm_new_scan:
      session_.start_new_scan();
      follows_ = true;
      return say("A new scan begins.", now_s);
    case Dialog::confirm_leave:
      wants_to_close_ = true;
      return;
    case Dialog::choose_export:
      export_ = "ply";
      return;
    case Dialog::help:
    case Dialog::none:
      return;
  }
}

void LiveControls::refuse() { dialog_ = Dialog::none; }

void LiveControls::choose_format(const std::string& extension) {
  dialog_ = Dialog::none;
  export_ = extension;
}

void LiveControls::say(std::string text, double now_s) {
  add_toast({std::move(text), false, now_s + toast_s});
}

void LiveControls::complain(std::string text, double now_s) {
  add_toast({std::move(text), true, now_s + complaint_s});
}

void LiveControls::add_toast(Toast toast) {
  // The same words again (a key held down) are shown longer, not twice.
  std::erase_if(toasts_, [&toast](const Toast& old) { return old.text == toast.text; });
  toasts_.push_back(std::move(toast));
  if (toasts_.size() > max_toasts) toasts_.pop_front();
}

void LiveControls::drop_old_toasts(double now_s) {
  std::erase_if(toasts_, [now_s](const Toast& toast) { return toast.until_s <= now_s; });
}

}  // namespace gelslam::viewer::detail
