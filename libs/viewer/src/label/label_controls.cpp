#include "label/label_controls.hpp"

#include <GLFW/glfw3.h>

#include <cmath>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double step_px = 0.5;
constexpr double message_s = 5.0, trouble_s = 60.0;

}  // namespace

const std::vector<KeyBinding<LabelAction>>& label_keys() {
  using enum LabelAction;
  static const std::vector<KeyBinding<LabelAction>> keys = {
      {accept, GLFW_KEY_ENTER, GLFW_KEY_SPACE, "Enter", "Accept, and on"},
      {back, GLFW_KEY_BACKSPACE, 0, "Backspace", "One back"},
      {next, GLFW_KEY_N, GLFW_KEY_TAB, "N", "One on, nothing decided"},
      {leave_out, GLFW_KEY_X, GLFW_KEY_DELETE, "X", "Leave this press out"},
      {accept_rest, GLFW_KEY_A, 0, "A", "Accept all that remain"},
      {left, GLFW_KEY_LEFT, 0, "Arrows", "Move by half a pixel"},
      {right, GLFW_KEY_RIGHT, 0, "", ""},
      {up, GLFW_KEY_UP, 0, "", ""},
      {down, GLFW_KEY_DOWN, 0, "", ""},
      {wider, GLFW_KEY_EQUAL, GLFW_KEY_KP_ADD, "+ or PgUp", "Wider by half a pixel"},
      {wider, GLFW_KEY_PAGE_UP, GLFW_KEY_RIGHT_BRACKET, "", ""},
      {narrower, GLFW_KEY_MINUS, GLFW_KEY_KP_SUBTRACT, "- or PgDn", "Narrower by half a pixel"},
      {narrower, GLFW_KEY_PAGE_DOWN, GLFW_KEY_SLASH, "", ""},
      {use_found, GLFW_KEY_F, 0, "F", "Back to the circle found"},
      {difference, GLFW_KEY_D, 0, "D", "Difference to the bare gel, or not"},
      {undo, GLFW_KEY_U, GLFW_KEY_Z, "U", "Undo"},
      {save, GLFW_KEY_S, 0, "S", "Save now"},
      {screenshot, GLFW_KEY_P, 0, "P", "Picture of this window (PNG)"},
      {help, GLFW_KEY_H, GLFW_KEY_F1, "H", "This help"},
      {quit, GLFW_KEY_Q, GLFW_KEY_ESCAPE, "Q", "Save and end"},
  };
  return keys;
}

void LabelControls::press_key(int key, double now_s) {
  if (shows_help_ && key == GLFW_KEY_ESCAPE) {
    shows_help_ = false;
    return;
  }
  if (const auto action = action_of_key(label_keys(), key)) perform(*action, now_s);
}

void LabelControls::perform(LabelAction action, double now_s) {
  using enum LabelAction;
  if (action == wider) return change_radius(step_px);
  if (action == narrower) return change_radius(-step_px);
  turns_wheel_ = false;
  end_drag();
  if (action == quit) return end(now_s);
  leaves_unsaved_ = false;
  switch (action) {
    case accept:
      return session_.accept();
    case back:
      return session_.show_previous();
    case next:
      return session_.show_next();
    case leave_out:
      return session_.leave_out();
    case accept_rest:
      return accept_rest_of_them(now_s);
    case left:
      return move(-step_px, 0.0);
    case right:
      return move(step_px, 0.0);
    case up:
      return move(0.0, -step_px);
    case down:
      return move(0.0, step_px);
    case use_found:
      return session_.put_found();
    case difference:
      shows_difference_ = !shows_difference_;
      return;
    case undo:
      if (!session_.undo()) say("There is nothing to undo", now_s);
      return;
    case save:
      save_now(now_s);
      return;
    case screenshot:
      screenshot_ = true;
      return;
    case help:
      shows_help_ = !shows_help_;
      return;
    case quit:
    case wider:
    case narrower:
      return;
  }
}

void LabelControls::move(double du_px, double dv_px) {
  ContactCircle circle = session_.label().circle;
  circle.u_px += du_px;
  circle.v_px += dv_px;
  session_.put(circle);
}

void LabelControls::change_radius(double by_px) {
  leaves_unsaved_ = false;
  ContactCircle circle = session_.label().circle;
  circle.radius_px += by_px;
  turns_wheel_ = session_.put(circle, turns_wheel_) || turns_wheel_;
}

void LabelControls::begin_drag(double u_px, double v_px, double reach_px) {
  const ContactCircle& circle = session_.label().circle;
  const double from_center_px = std::hypot(u_px - circle.u_px, v_px - circle.v_px);
  turns_wheel_ = leaves_unsaved_ = false;
  drag_ = Drag{std::abs(from_center_px - circle.radius_px) <= reach_px, false, u_px, v_px, circle};
}

void LabelControls::drag_to(double u_px, double v_px) {
  if (!drag_) return;
  ContactCircle circle = drag_->circle;
  if (drag_->rim) {
    circle.radius_px += std::hypot(u_px - circle.u_px, v_px - circle.v_px) -
                        std::hypot(drag_->u_px - circle.u_px, drag_->v_px - circle.v_px);
  } else {
    circle.u_px += u_px - drag_->u_px;
    circle.v_px += v_px - drag_->v_px;
  }
  drag_->moved = session_.put(circle, drag_->moved) || drag_->moved;
}

void LabelControls::show(std::size_t label) {
  turns_wheel_ = leaves_unsaved_ = false;
  end_drag();
  session_.show(label);
}

void LabelControls::accept_rest_of_them(double now_s) {
  const std::size_t unclear = session_.accept_rest();
  if (unclear == 1) say("One without a clear contact is left: move its circle, or leave it out (X)", now_s);
  if (unclear > 1)
    say(format_text("%zu without a clear contact are left: move their circles, or leave them out (X)",
                    unclear),
        now_s);
}

bool LabelControls::save_now(double now_s) {
  const std::size_t before = session_.unsaved();
  try {
    session_.save();
    say(before == 0 ? "Nothing new to save" : counted(static_cast<std::int64_t>(before), "press") + " saved",
        now_s);
  } catch (const Error& error) {
    say(error.what(), now_s);
    message_until_s_ = now_s + trouble_s;
  }
  written_ += before - session_.unsaved();
  return session_.unsaved() == 0;
}

void LabelControls::end(double now_s) {
  wants_to_close_ = save_now(now_s) || leaves_unsaved_;
  if (wants_to_close_) return;
  leaves_unsaved_ = true;
  message_ += ". Nothing is lost yet: S tries again, Q once more leaves without them";
}

void LabelControls::say(std::string message, double now_s) {
  message_ = std::move(message);
  message_until_s_ = now_s + message_s;
}

void LabelControls::forget_old_message(double now_s) {
  if (now_s >= message_until_s_) message_.clear();
}

}  // namespace gelslam::viewer::detail
