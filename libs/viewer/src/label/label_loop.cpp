#include "label/label_loop.hpp"

#include <GLFW/glfw3.h>

#include <algorithm>

#include "gelslam/core/error.hpp"
#include "label/label_picture.hpp"
#include "live/window_mesh.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double frame_s = 1.0 / 60, idle_redraw_s = 0.5;
constexpr float rim_reach = 9;  // design pixels
constexpr double wheel_step_px = 0.5;

}  // namespace

LabelLoop::LabelLoop(LabelSession& session, const LabelWindowOptions& options)
    : session_(session),
      options_(options),
      host_({options.title, options.width_px, options.height_px, options.visible}),
      controls_(session),
      player_(parse_script(options.script, options.script_name), options.script_name) {}

void LabelLoop::run() {
  const WindowClock clock;
  try {
    while (!controls_.wants_to_close() && !player_.wants_to_quit()) {
      const double begin_s = clock.now_s();
      turn(begin_s);
      host_.wait(std::max(frame_s - (clock.now_s() - begin_s), 0.001));
    }
  } catch (const std::exception& error) {
    save_after(error);
    throw;
  }
  written_at_end_ = session_.save();
}

/// What was decided outlives a window that fails.
void LabelLoop::save_after(const std::exception& failure) {
  try {
    session_.save();
  } catch (const Error& error) {
    throw Error(std::string(failure.what()) + "; and " + error.what());
  }
}

bool LabelLoop::turn(double now_s) {
  const bool scripted = !player_.done();
  if (!end_asked_ && options_.asks_to_end && options_.asks_to_end()) {
    end_asked_ = draw_next_ = true;
    controls_.perform(LabelAction::quit, now_s);
  }
  if (scripted) player_.play({LiveState::finished, layout_.picture, &texts_}, host_, now_s);
  handle_input(now_s);
  const bool had_message = !controls_.message().empty();
  controls_.forget_old_message(now_s);
  const bool changed = scripted || input_seen_ || draw_next_ || had_message != !controls_.message().empty();
  if (!changed && now_s - drawn_s_ < idle_redraw_s) return false;
  draw_next_ = false;
  draw(now_s);
  drawn_s_ = now_s;
  return true;
}

void LabelLoop::show_press() {
  const std::pair wanted{session_.label().press, controls_.shows_difference()};
  if (shown_ == wanted) return;
  shown_ = wanted;
  const cv::Mat3b& press = session_.press().bgr;
  texture_.set(wanted.second ? difference_picture(press, session_.set().background) : press);
}

void LabelLoop::draw(double now_s) {
  host_.begin_frame(std::max(1e-3, now_s - drawn_s_));
  show_press();
  const Viewport window = host_.viewport();
  {
    Canvas canvas(host_.ui_scale());
    canvas.fill({0, 0, static_cast<float>(window.width), static_cast<float>(window.height)}, theme::backdrop);
    layout_ = lay_out_labels(canvas, static_cast<float>(window.width), static_cast<float>(window.height),
                             session_.set().background.size());
    draw_label_panels(canvas, layout_, session_, texture_, options_.pixel_pitch_mm, now_s, controls_);
    texts_ = canvas.take_texts();
    panels_ = canvas.take_panels();
  }
  host_.end_frame();
  fulfil_wishes(now_s);
  host_.present();
}

void LabelLoop::fulfil_wishes(double now_s) {
  player_.write_screenshot(host_, options_.picture_folder);
  if (!controls_.take_screenshot()) return;
  controls_.say(save_picture(host_, options_.picture_folder, "labels").sentence, now_s);
  draw_next_ = true;
}

cv::Mat3b LabelLoop::picture(double now_s) {
  host_.want_picture();
  draw_next_ = true;
  turn(now_s);
  return host_.take_picture();
}

void LabelLoop::handle_input(double now_s) {
  const std::vector<InputEvent> events = host_.take_input();
  input_seen_ = !events.empty();
  draw_next_ |= input_seen_;  // what a button does shows in the frame after the click
  for (const InputEvent& event : events) {
    switch (event.kind) {
      case InputEvent::Kind::key:
        if (event.pressed) controls_.press_key(event.code, now_s);
        break;
      case InputEvent::Kind::close:
        controls_.perform(LabelAction::quit, now_s);
        break;
      case InputEvent::Kind::pointer:
        pointer_x_ = event.x;
        pointer_y_ = event.y;
        controls_.drag_to(layout_.u_of(pointer_x_), layout_.v_of(pointer_y_));
        break;
      case InputEvent::Kind::button:
        if (event.code == GLFW_MOUSE_BUTTON_LEFT) handle_button(event);
        break;
      case InputEvent::Kind::scroll:
        if (layout_.view.contains(pointer_x_, pointer_y_)) controls_.change_radius(wheel_step_px * event.y);
        break;
    }
  }
}

void LabelLoop::handle_button(const InputEvent& event) {
  if (!event.pressed) return controls_.end_drag();
  if (const auto label = layout_.label_at(pointer_x_, pointer_y_, session_.labels().size()))
    return controls_.show(*label);
  const bool on_panel = std::any_of(panels_.begin(), panels_.end(),
                                    [&](const Box& panel) { return panel.contains(pointer_x_, pointer_y_); });
  if (on_panel || !layout_.view.contains(pointer_x_, pointer_y_)) return;
  controls_.begin_drag(layout_.u_of(pointer_x_), layout_.v_of(pointer_y_),
                       static_cast<double>(rim_reach * host_.ui_scale() / layout_.enlargement));
}

}  // namespace gelslam::viewer::detail

namespace gelslam {

std::size_t run_label_window(LabelSession& session, const LabelWindowOptions& options) {
  viewer::detail::LabelLoop loop(session, options);
  loop.run();
  return loop.written();
}

void write_label_snapshot(LabelSession& session, const std::filesystem::path& png,
                          const LabelWindowOptions& options) {
  LabelWindowOptions without_display = options;
  without_display.visible = false;
  without_display.script.clear();
  viewer::detail::LabelLoop loop(session, without_display);
  viewer::detail::write_png(png.string(), loop.picture(0.01));
}

}  // namespace gelslam
