#include "windows/label_window.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "presses/press_fit.hpp"

namespace gelslam::calibration::detail {
namespace {

constexpr float kRimReach = 9;  // design pixels
constexpr double kWheelStepPx = 0.5;
/// Of the difference: noise is not stretched to full contrast.
constexpr double kMidGray = 128.0, kReach = 120.0, kSmoothPx = 0.8, kShown = 0.99, kMinLevels = 6.0;

}  // namespace

LabelWindow::LabelWindow(LabelSession& session, const LabelWindowOptions& options)
    : WindowLoop(options), session_(session), options_(options), controls_(session) {}

void LabelWindow::run_and_save() {
  try {
    run();
  } catch (const std::exception& error) {
    save_after(error);
    throw;
  }
  written_at_end_ = session_.save();
}

/// What was decided outlives a window that fails.
void LabelWindow::save_after(const std::exception& failure) {
  try {
    session_.save();
  } catch (const Error& error) {
    throw Error(std::string(failure.what()) + "; and " + error.what());
  }
}

bool LabelWindow::advance(double now_s, double /*dt_s*/) {
  if (end_asked_ || !options_.asks_to_end || !options_.asks_to_end()) return false;
  end_asked_ = true;
  controls_.perform(viewer::Action::close, now_s);
  return true;
}

void LabelWindow::show_press() {
  const std::pair wanted{session_.label().press, controls_.shows_difference()};
  if (shown_ == wanted) return;
  shown_ = wanted;
  const cv::Mat3b& press = session_.press().bgr;
  texture_.set(wanted.second ? difference_picture(press, session_.set().background) : press);
}

void LabelWindow::draw_frame(viewer::Ui& ui, double now_s) {
  show_press();
  ui.fill(ui.window(), viewer::theme::kBackdrop);
  layout_ = lay_out_labels(ui, session_.set().background.size());
  set_view(layout_.picture);
  draw_press(ui, layout_, session_, texture_, controls_.drags_rim());
  if (layout_.side.width > 0) draw_label_side(ui, layout_.side, session_, options_.pixel_pitch_mm);
  if (layout_.bar.width <= 0) return;
  if (const auto clicked = draw_strip(ui, layout_, session_)) controls_.show(*clicked);
  viewer::draw_action_bar(ui, layout_.bar, controls_, now_s);
}

void LabelWindow::pressed(int button, const Eigen::Vector2f& at_px, double /*now_s*/) {
  if (button != 0 || !layout_.view.contains(at_px.x(), at_px.y())) return;
  controls_.begin_drag(layout_.u_of(at_px.x()), layout_.v_of(at_px.y()),
                       static_cast<double>(kRimReach * host().ui_scale() / layout_.enlargement));
}

void LabelWindow::moved(const Eigen::Vector2f& to_px) {
  controls_.drag_to(layout_.u_of(to_px.x()), layout_.v_of(to_px.y()));
}

void LabelWindow::released(int button) {
  if (button == 0) controls_.end_drag();
}

void LabelWindow::scrolled(double steps, const Eigen::Vector2f& at_px) {
  if (layout_.view.contains(at_px.x(), at_px.y())) controls_.change_radius(kWheelStepPx * steps);
}

cv::Mat3b difference_picture(const cv::Mat3b& bgr, const cv::Mat3b& background) {
  cv::Mat3f change = press_change(bgr, background);
  cv::GaussianBlur(change, change, cv::Size(), kSmoothPx);
  std::vector<double> sizes;
  for (const cv::Vec3f& c : change)
    for (int channel = 0; channel < 3; ++channel) sizes.push_back(static_cast<double>(std::abs(c[channel])));
  cv::Mat3b picture;
  change.convertTo(picture, CV_8U, kReach / std::max(kMinLevels, quantile(sizes, kShown)), kMidGray);
  return picture;
}

}  // namespace gelslam::calibration::detail

namespace gelslam {

std::size_t run_label_window(LabelSession& session, const LabelWindowOptions& options) {
  calibration::detail::LabelWindow window(session, options);
  window.run_and_save();
  return window.written();
}

void write_label_snapshot(LabelSession& session, const std::filesystem::path& png,
                          const LabelWindowOptions& options) {
  LabelWindowOptions hidden = options;
  hidden.visible = false;
  viewer::write_png(png, calibration::detail::LabelWindow(session, hidden).picture(0.01));
}

}  // namespace gelslam
