#include "windows/press_window.hpp"

#include <opencv2/imgproc.hpp>

#include "gelslam/core/error.hpp"

namespace gelslam::calibration::detail {
namespace {

constexpr float kRimReach = 9;  // design pixels
constexpr double kWheelStepPx = 0.5;

}  // namespace

PressWindow::PressWindow(LabelSession& session, CollectWatch* camera, const PressWindowOptions& options)
    : WindowLoop(options),
      session_(session),
      camera_(camera),
      options_(options),
      controls_(session, camera != nullptr) {}

void PressWindow::run_and_save() {
  try {
    run();
  } catch (const std::exception& error) {
    try {
      session_.save();  // Saves the decisions even if the window fails.
    } catch (const Error& unsaved) {
      throw Error(std::string(error.what()) + "; and " + unsaved.what());
    }
    throw;
  }
  session_.save();
}

bool PressWindow::advance(double now_s, double /*dt_s*/) {
  if (camera_) follow_camera();
  if (!end_asked_ && asks_to_end()) {
    end_asked_ = true;
    controls_.perform(viewer::Action::close, now_s);
    return true;
  }
  return camera_ != nullptr;
}

void PressWindow::follow_camera() {
  live_ = camera_->view();
  for (TakenPress& taken : camera_->taken())
    session_.add(std::move(taken.press), taken.found, live_.background);
  camera_->count(session_.contacts(camera_->diameter_mm()));
}

void PressWindow::show_picture() {
  if (controls_.shows_camera()) {
    shown_.reset();
    texture_.set(live_.bgr);
    return;
  }
  if (shown_ == session_.label().press) return;
  shown_ = session_.label().press;
  texture_.set(session_.press().bgr);
}

void PressWindow::draw_frame(viewer::Ui& ui, double now_s) {
  const bool live = controls_.shows_camera();
  show_picture();
  ui.fill(ui.window(), viewer::theme::kBackdrop);
  layout_ = lay_out_presses(ui, live ? live_.bgr.size() : session_.set().background.size());
  set_view(layout_.picture);
  if (live) {
    draw_camera(ui, layout_, live_, texture_);
    draw_camera_side(ui, layout_.side, live_);
  } else {
    draw_press(ui, layout_, session_, texture_, controls_.drags_rim());
    draw_press_side(ui, layout_.side, session_, options_.pixel_pitch_mm);
  }
  if (layout_.bar.width <= 0) return;
  if (const auto clicked = draw_strip(ui, layout_, session_, camera_ != nullptr, live))
    controls_.show(*clicked);
  viewer::draw_action_bar(ui, layout_.bar, controls_, now_s);
}

bool PressWindow::is_on_press(const Eigen::Vector2f& at_px) const {
  return !controls_.shows_camera() && layout_.view.contains(at_px.x(), at_px.y());
}

void PressWindow::pressed(int button, const Eigen::Vector2f& at_px, double /*now_s*/) {
  if (button != 0 || !is_on_press(at_px)) return;
  controls_.begin_drag(layout_.u_of(at_px.x()), layout_.v_of(at_px.y()),
                       static_cast<double>(kRimReach * host().ui_scale() / layout_.enlargement));
}

void PressWindow::moved(const Eigen::Vector2f& to_px) {
  controls_.drag_to(layout_.u_of(to_px.x()), layout_.v_of(to_px.y()));
}

void PressWindow::released(int button) {
  if (button == 0) controls_.end_drag();
}

void PressWindow::scrolled(double steps, const Eigen::Vector2f& at_px) {
  if (is_on_press(at_px)) controls_.nudge(0, 0, kWheelStepPx * steps);
}

}  // namespace gelslam::calibration::detail

namespace gelslam {

void run_press_window(LabelSession& session, CollectWatch* camera, const PressWindowOptions& options) {
  PressWindowOptions follows = options;
  if (camera) follows.poll_s = 1.0 / 30;
  calibration::detail::PressWindow(session, camera, follows).run_and_save();
}

}  // namespace gelslam
