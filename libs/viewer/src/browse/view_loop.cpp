#include "browse/view_loop.hpp"

#include <GLFW/glfw3.h>

#include <algorithm>

#include "gelslam/core/error.hpp"
#include "live/window_mesh.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double kFrame_s = 1.0 / 60, kIdleRedraw_s = 0.5, kMessage_s = 5;
constexpr double kDoubleClick_s = 0.35;
constexpr float kDoubleClick_px = 6;

}  // namespace

ViewLoop::ViewLoop(ViewContent first, std::optional<ViewContent> second, const ViewWindowOptions& options)
    : options_(options),
      host_({options.title, options.width_px, options.height_px, options.visible}),
      stage_(std::move(first), std::move(second)),
      controls_(stage_.history(), stage_.has_second(), options.style, options.time_s),
      player_(parse_script(options.script, options.script_name), options.script_name) {
  show_time();
}

void ViewLoop::run() {
  const WindowClock clock;
  while (!controls_.wants_to_close() && !player_.wants_to_quit()) {
    const double begin_s = clock.now_s();
    turn(begin_s);
    host_.wait(works_ ? 0 : std::max(kFrame_s - (clock.now_s() - begin_s), 0.001));
  }
}

bool ViewLoop::turn(double now_s) {
  const bool scripted = !player_.done();
  if (scripted) player_.play({LiveState::finished, layout_.view, &texts_}, host_, now_s);
  const double dt_s = std::clamp(now_s - drawn_s_, 1e-3, 0.1);
  handle_input(now_s);
  const bool plays = controls_.advance(dt_s);
  show_time();
  works_ = stage_.work();
  const bool moves = move_camera(dt_s);
  const bool changed =
      scripted || input_seen_ || plays || works_ || moves || draw_next_ || !stage_.is_complete();
  if (!changed && now_s - drawn_s_ < kIdleRedraw_s) return false;
  draw_next_ = false;
  draw(now_s);
  drawn_s_ = now_s;
  return true;
}

void ViewLoop::show_time() {
  if (shown_time_s_ == controls_.time_s()) return;
  shown_time_s_ = controls_.time_s();
  stage_.set_time(shown_time_s_);
}

bool ViewLoop::move_camera(double dt_s) {
  if (controls_.take_show_all()) goal_ = stage_.first_view(view_viewport());
  if (!goal_) return false;
  camera_.glide_to(*goal_, dt_s);
  const bool there = (camera_.eye_mm() - goal_->eye_mm()).norm() < 1e-3F * goal_->distance_mm() &&
                     (camera_.map_R_camera() - goal_->map_R_camera()).norm() < 1e-3F;
  if (there) goal_.reset();
  return true;
}

void ViewLoop::draw(double now_s) {
  host_.begin_frame(std::max(1e-3, now_s - drawn_s_));
  const Viewport window = host_.viewport();
  {
    Canvas canvas(host_.ui_scale());
    layout_ =
        lay_out_view(canvas, static_cast<float>(window.width), static_cast<float>(window.height), controls_);
    if (!std::exchange(camera_is_set_, true)) {
      camera_ = stage_.first_view(view_viewport());
      const Eigen::Vector2d turn_deg(options_.yaw_deg, options_.pitch_deg);
      camera_.orbit((turn_deg / 180 * view_viewport().height).cast<float>(), view_viewport());
    }
    stage_.draw(camera_, view_viewport(), controls_.style());
    draw_view_panels(canvas, layout_, gather(now_s), stage_.history(), controls_);
    texts_ = canvas.take_texts();
    panels_ = canvas.take_panels();
  }
  host_.end_frame();
  fulfil_wishes(now_s);
  host_.present();
}

ViewFrame ViewLoop::gather(double now_s) const {
  ViewFrame frame;
  const Viewport view = view_viewport();
  for (const Viewport& part : stage_.parts(view)) {
    frame.titles.push_back(stage_.title(frame.parts.size()));
    frame.parts.push_back(
        {static_cast<float>(part.x), 0, static_cast<float>(part.width), static_cast<float>(part.height)});
  }
  frame.legend = stage_.legend(controls_.style());
  frame.mm_per_px = static_cast<double>(camera_.mm_per_px(camera_.distance_mm(), view));
  frame.works = works_;
  if (now_s < message_until_s_) frame.message = message_;
  return frame;
}

void ViewLoop::fulfil_wishes(double now_s) {
  player_.write_screenshot(host_, options_.picture_folder);
  if (!controls_.take_screenshot()) return;
  message_ = save_picture(host_, options_.picture_folder, "view").sentence;
  message_until_s_ = now_s + kMessage_s;
  draw_next_ = true;
}

cv::Mat3b ViewLoop::picture(double now_s) {
  host_.want_picture();
  draw_next_ = true;
  turn(now_s);
  return host_.take_picture();
}

Viewport ViewLoop::view_viewport() const {
  const Viewport whole = host_.viewport();
  const Box& view = layout_.view;
  return {0, whole.height - static_cast<int>(view.height), std::max(1, static_cast<int>(view.width)),
          std::max(1, static_cast<int>(view.height))};
}

bool ViewLoop::on_panel(const Eigen::Vector2f& pixel) const {
  return std::any_of(panels_.begin(), panels_.end(),
                     [&](const Box& p) { return p.contains(pixel.x(), pixel.y()); });
}

Eigen::Vector2f ViewLoop::in_part(const Eigen::Vector2f& pixel, Viewport& part) const {
  const std::vector<Viewport> parts = stage_.parts(view_viewport());
  part = parts.size() > 1 && pixel.x() >= static_cast<float>(parts[1].x) ? parts[1] : parts[0];
  return pixel - Eigen::Vector2f(static_cast<float>(part.x), 0);
}

void ViewLoop::handle_input(double now_s) {
  const std::vector<InputEvent> events = host_.take_input();
  input_seen_ = !events.empty();
  for (const InputEvent& event : events) {
    switch (event.kind) {
      case InputEvent::Kind::key:
        if (event.pressed) controls_.press_key(event.code);
        break;
      case InputEvent::Kind::close:
        controls_.perform(ViewAction::close);
        break;
      case InputEvent::Kind::pointer:
        handle_pointer(Eigen::Vector2d(event.x, event.y).cast<float>());
        break;
      case InputEvent::Kind::button:
        handle_button(event, now_s);
        break;
      case InputEvent::Kind::scroll: {
        if (on_panel(pointer_px_)) break;
        goal_.reset();
        Viewport part;
        const Eigen::Vector2f cursor = in_part(pointer_px_, part);
        camera_.zoom(event.y, cursor, part);
        break;
      }
    }
  }
}

void ViewLoop::handle_pointer(const Eigen::Vector2f& pointer_px) {
  const Eigen::Vector2f movement = pointer_px - pointer_px_;
  pointer_px_ = pointer_px;
  if (drags_slider_) controls_.seek((pointer_px.x() - layout_.track.x) / std::max(layout_.track.width, 1.0F));
  if (!drag_button_ || movement.isZero()) return;
  goal_.reset();
  if (*drag_button_ == GLFW_MOUSE_BUTTON_LEFT) {
    camera_.orbit(movement, view_viewport());
  } else {
    camera_.pan(movement, view_viewport());
  }
}

void ViewLoop::handle_button(const InputEvent& event, double now_s) {
  if (!event.pressed) {
    if (drag_button_ == event.code) drag_button_.reset();
    drags_slider_ = false;
    return;
  }
  if (event.code == GLFW_MOUSE_BUTTON_LEFT && layout_.track.contains(pointer_px_.x(), pointer_px_.y())) {
    drags_slider_ = true;
    handle_pointer(pointer_px_);
    return;
  }
  if (drag_button_ || on_panel(pointer_px_)) return;
  drag_button_ = event.code;
  if (event.code != GLFW_MOUSE_BUTTON_LEFT) return;
  const bool twice =
      now_s - pressed_s_ < kDoubleClick_s && (pointer_px_ - pressed_px_).norm() < kDoubleClick_px;
  pressed_s_ = now_s;
  pressed_px_ = pointer_px_;
  if (!twice) return;
  if (const auto place = stage_.pick(camera_, pointer_px_, view_viewport())) {
    goal_ = camera_;
    goal_->look_at(*place);
  }
}

}  // namespace gelslam::viewer::detail

namespace gelslam {

void run_view_window(ViewContent first, std::optional<ViewContent> second, const ViewWindowOptions& options) {
  viewer::detail::ViewLoop(std::move(first), std::move(second), options).run();
}

}  // namespace gelslam
