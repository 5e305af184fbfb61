#include "windows/press_controls.hpp"

#include <cmath>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam::calibration::detail {
namespace {

using viewer::Action;

constexpr double kStepPx = 0.5;
constexpr double kTroubleS = 60.0;

std::vector<viewer::ActionRow> press_rows(bool has_camera) {
  using enum Action;
  const std::vector<int> plus = {GLFW_KEY_EQUAL, GLFW_KEY_KP_ADD, GLFW_KEY_PAGE_UP, GLFW_KEY_RIGHT_BRACKET},
                         minus = {GLFW_KEY_MINUS, GLFW_KEY_KP_SUBTRACT, GLFW_KEY_PAGE_DOWN, GLFW_KEY_SLASH};
  const char *on = has_camera ? "On" : "", *on_help = has_camera ? "One on, at last the camera" : "Skip";
  return {
      {accept, {GLFW_KEY_ENTER, GLFW_KEY_SPACE}, "Enter", "Accept", 0, 1, "Accept, and on"},
      {previous, {GLFW_KEY_BACKSPACE}, "Backspace", "Back", 0, 3, "One back"},
      {next, {GLFW_KEY_N, GLFW_KEY_TAB}, "N", on, 0, 3, on_help},
      {leave_out, {GLFW_KEY_X, GLFW_KEY_DELETE}, "X", "Leave out", 0, 2, "Leave this press out"},
      {accept_rest, {GLFW_KEY_A}, "A", "Accept the rest", 0, 4, "Accept all that remain"},
      {left, {GLFW_KEY_LEFT}, "Arrows", "", 0, 0, "Move by half a pixel"},
      {right, {GLFW_KEY_RIGHT}, "", "", 0, 0, ""},
      {up, {GLFW_KEY_UP}, "", "", 0, 0, ""},
      {down, {GLFW_KEY_DOWN}, "", "", 0, 0, ""},
      {wider, plus, "+ or PgUp", "", 0, 0, "Wider by half a pixel"},
      {narrower, minus, "- or PgDn", "", 0, 0, "Narrower by half a pixel"},
      viewer::common_row(screenshot),
      {help, {GLFW_KEY_H, GLFW_KEY_F1}, "H", "Help", 2, 3, "This help"},
      {close, {GLFW_KEY_Q, GLFW_KEY_ESCAPE}, "Q", "Save and end", 2, 0, "Save and end"},
  };
}

/// Says whether an action changes the current press and therefore has no effect while the camera is shown.
bool changes_press(Action action) {
  using enum Action;
  for (const Action a : {accept, leave_out, left, right, up, down, wider, narrower, next})
    if (a == action) return true;
  return false;
}

}  // namespace

PressControls::PressControls(LabelSession& session, bool has_camera)
    : Controls(press_rows(has_camera)),
      session_(session),
      has_camera_(has_camera),
      shows_camera_(has_camera) {}

viewer::ButtonLook PressControls::button(const viewer::ActionRow& row) const {
  viewer::ButtonLook look = Controls::button(row);
  if (row.action == Action::accept) look.ink = viewer::theme::kGreen;
  if (row.action == Action::screenshot) look.shown = false;  // A key suffices for this action.
  if (shows_camera_ && changes_press(row.action)) look.shown = false;
  return look;
}

std::vector<std::pair<std::string, std::string>> PressControls::mouse_help() const {
  return {{"Drag", "Move the circle"}, {"Drag its rim", "Radius"}, {"Wheel", "Radius"}};
}

void PressControls::act(Action action, double now_s) {
  end_drag();
  if (action == Action::close) return save_and_close(now_s);
  leaves_unsaved_ = false;
  const std::size_t shown = shows_camera_ ? session_.labels().size() : session_.current();
  if (action == Action::previous && shown > 0) return show(shown - 1);
  if (action == Action::next) return show(shown + 1);
  if (action == Action::accept_rest) return accept_rest_of_them(now_s);
  if (!shows_camera_) act_on_press(action);
}

void PressControls::act_on_press(Action action) {
  if (action == Action::accept) shows_camera_ = !session_.accept() && has_camera_;
  if (action == Action::leave_out) shows_camera_ = !session_.leave_out() && has_camera_;
  if (action == Action::left) nudge(-kStepPx, 0, 0);
  if (action == Action::right) nudge(kStepPx, 0, 0);
  if (action == Action::up) nudge(0, -kStepPx, 0);
  if (action == Action::down) nudge(0, kStepPx, 0);
  if (action == Action::wider) nudge(0, 0, kStepPx);
  if (action == Action::narrower) nudge(0, 0, -kStepPx);
}

void PressControls::nudge(double du_px, double dv_px, double dradius_px) {
  leaves_unsaved_ = false;
  const ContactCircle& circle = session_.label().circle;
  session_.put({circle.u_px + du_px, circle.v_px + dv_px, circle.radius_px + dradius_px});
}

void PressControls::begin_drag(double u_px, double v_px, double reach_px) {
  const ContactCircle& circle = session_.label().circle;
  const double from_center_px = std::hypot(u_px - circle.u_px, v_px - circle.v_px);
  leaves_unsaved_ = false;
  drag_ = Drag{std::abs(from_center_px - circle.radius_px) <= reach_px, u_px, v_px, circle};
}

void PressControls::drag_to(double u_px, double v_px) {
  if (!drag_) return;
  ContactCircle circle = drag_->circle;
  if (drag_->rim) {
    circle.radius_px += std::hypot(u_px - circle.u_px, v_px - circle.v_px) -
                        std::hypot(drag_->u_px - circle.u_px, drag_->v_px - circle.v_px);
  } else {
    circle.u_px += u_px - drag_->u_px;
    circle.v_px += v_px - drag_->v_px;
  }
  session_.put(circle);
}

void PressControls::show(std::size_t label) {
  leaves_unsaved_ = false;
  end_drag();
  shows_camera_ = has_camera_ && label >= session_.labels().size();
  if (!shows_camera_) session_.show(label);
}

void PressControls::accept_rest_of_them(double now_s) {
  const std::size_t unclear = session_.accept_rest();
  if (unclear == 0) return;
  shows_camera_ = false;
  say("Left: " + counted(static_cast<std::int64_t>(unclear), "press") +
          " without a clear contact; move the circle, or leave it out (X)",
      now_s);
}

void PressControls::save_and_close(double now_s) {
  try {
    session_.save();
    close();
  } catch (const Error& error) {
    if (leaves_unsaved_) return close();
    leaves_unsaved_ = true;
    complain(std::string(error.what()) + ". Nothing is lost yet: Q tries again, and leaves without them",
             now_s, kTroubleS);
  }
}

}  // namespace gelslam::calibration::detail
