#include "windows/label_controls.hpp"

#include <cmath>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam::calibration::detail {
namespace {

using viewer::Action;

constexpr double kStepPx = 0.5;
constexpr double kTroubleS = 60.0;

std::vector<viewer::ActionRow> label_rows() {
  using enum Action;
  return {
      {accept, "enter space", "Enter", "Accept", 0, 1, "Accept, and on"},
      {previous, "backspace", "Backspace", "Back", 0, 3, "One back"},
      {next, "n tab", "N", "", 0, 0, "Skip"},
      {leave_out, "x delete", "X", "Leave out", 0, 2, "Leave this press out"},
      {accept_rest, "a", "A", "Accept the rest", 0, 4, "Accept all that remain"},
      {left, "left", "Arrows", "", 0, 0, "Move by half a pixel"},
      {right, "right", "", "", 0, 0, ""},
      {up, "up", "", "", 0, 0, ""},
      {down, "down", "", "", 0, 0, ""},
      {wider, "plus kp_add pageup bracket", "+ or PgUp", "", 0, 0, "Wider by half a pixel"},
      {narrower, "minus kp_subtract pagedown slash", "- or PgDn", "", 0, 0, "Narrower by half a pixel"},
      {difference, "d", "D", "Difference", 1, 5, "Difference to the bare gel, or not"},
      {use_found, "f", "F", "As found", 1, 6, "Back to the circle found"},
      {undo, "u z", "U", "Undo", 1, 5, "Undo"},
      {save, "s", "S", "Save", 2, 7, "Save now"},
      viewer::common_row(screenshot),
      {help, "h f1", "H", "Help", 2, 3, "This help"},
      {close, "q esc", "Q", "Save and end", 2, 0, "Save and end"},
  };
}

}  // namespace

LabelControls::LabelControls(LabelSession& session) : Controls(label_rows()), session_(session) {}

viewer::ButtonLook LabelControls::button(const viewer::ActionRow& row) const {
  viewer::ButtonLook look = Controls::button(row);
  if (row.action == Action::accept) look.ink = viewer::theme::kGreen;
  if (row.action == Action::difference && shows_difference_) look.ink = viewer::theme::kBlue;
  if (row.action == Action::screenshot) look.shown = false;  // a key is enough here
  return look;
}

std::vector<std::pair<std::string, std::string>> LabelControls::mouse_help() const {
  return {{"Drag", "Move the circle"}, {"Drag its rim", "Radius"}, {"Wheel", "Radius"}};
}

void LabelControls::act(Action action, double now_s) {
  if (action == Action::wider) return change_radius(kStepPx);
  if (action == Action::narrower) return change_radius(-kStepPx);
  turns_wheel_ = false;
  end_drag();
  if (action == Action::close) return save_and_close(now_s);
  leaves_unsaved_ = false;
  switch (action) {
    case Action::accept:
      return session_.accept();
    case Action::previous:
      return session_.show_previous();
    case Action::next:
      return session_.show_next();
    case Action::leave_out:
      return session_.leave_out();
    case Action::accept_rest:
      return accept_rest_of_them(now_s);
    case Action::left:
      return move(-kStepPx, 0.0);
    case Action::right:
      return move(kStepPx, 0.0);
    case Action::up:
      return move(0.0, -kStepPx);
    case Action::down:
      return move(0.0, kStepPx);
    case Action::use_found:
      return session_.put_found();
    case Action::difference:
      shows_difference_ = !shows_difference_;
      return;
    case Action::undo:
      if (!session_.undo()) say("There is nothing to undo", now_s);
      return;
    case Action::save:
      save_now(now_s);
      return;
    default:
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
  if (unclear > 0)
    say("Left: " + counted(static_cast<std::int64_t>(unclear), "press") +
            " without a clear contact; move the circle, or leave it out (X)",
        now_s);
}

bool LabelControls::save_now(double now_s, const std::string& advice) {
  const std::size_t before = session_.unsaved();
  try {
    session_.save();
    say(before == 0 ? "Nothing new to save" : counted(static_cast<std::int64_t>(before), "press") + " saved",
        now_s);
  } catch (const Error& error) {
    complain(error.what() + advice, now_s, kTroubleS);
  }
  written_ += before - session_.unsaved();
  return session_.unsaved() == 0;
}

void LabelControls::save_and_close(double now_s) {
  const bool saved = save_now(now_s, ". Nothing is lost yet: S tries again, Q once more leaves without them");
  if (saved || leaves_unsaved_) return close();
  leaves_unsaved_ = true;
}

}  // namespace gelslam::calibration::detail
