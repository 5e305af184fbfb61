#include "gelslam/viewer/window_loop.hpp"

#include <GLFW/glfw3.h>

#include <algorithm>
#include <chrono>

#include "gelslam/core/error.hpp"

namespace gelslam::viewer {
namespace {

constexpr double kFrameS = 1.0 / 60;

double clock_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

void WindowLoop::run() {
  const double start_s = clock_s();
  while (!wants_to_close()) {
    const double begin_s = clock_s() - start_s;
    const bool drew = turn(begin_s);
    const double took_s = clock_s() - start_s - begin_s;
    if (drew || draw_next_) {
      // Without a graphics card, a frame takes long; then other threads get at least half of the time.
      host_->wait(std::max(kFrameS - took_s, options_.yields ? std::min(took_s, 0.1) : 0.001));
    } else {
      host_->wait(options_.poll_s);
    }
  }
  if (!options_.snapshot.empty()) write_png(options_.snapshot, picture(1e9));
}

bool WindowLoop::wants_to_close() { return controls().wants_to_close() || closes_by_itself(); }

bool WindowLoop::turn(double now_s, bool draw_anyway, cv::Mat3b* picture) {
  const bool due = std::exchange(draw_next_, false);
  handle_input(now_s);
  bool changed = controls().drop_old_toasts(now_s);
  changed |= advance(now_s, std::clamp(now_s - drawn_s_, 1e-3, 0.1));
  changed |= input_seen_ || due || draw_anyway;
  if (!changed && now_s - drawn_s_ < options_.redraw_s) return false;
  draw(now_s, picture);
  drawn_s_ = now_s;
  return true;
}

void WindowLoop::draw(double now_s, cv::Mat3b* picture) {
  host_->begin_frame(std::max(1e-3, now_s - drawn_s_));
  {
    Ui ui(host_->ui_scale());
    draw_frame(ui, now_s);
    draw_messages(ui, view_, controls());
    draw_dialogs(ui, controls(), now_s);
    draw_next_ |= ui.needs_another_frame();
    texts_ = ui.take_texts();
    panels_ = ui.take_panels();
  }
  host_->end_frame();
  if (controls().take_screenshot()) save_screenshot(now_s);
  if (picture != nullptr) *picture = host_->read();
  host_->present();
}

void WindowLoop::save_screenshot(double now_s) {
  const std::filesystem::path path = free_name(options_.picture_folder, options_.picture_stem);
  try {
    write_png(path, host_->read());
    controls().say("Picture: " + path.string(), now_s);
  } catch (const Error& error) {
    controls().complain(error.what(), now_s);
  }
  draw_next_ = true;
}

cv::Mat3b WindowLoop::picture(double now_s) {
  cv::Mat3b picture;
  turn(now_s, true, &picture);
  return picture;
}

bool WindowLoop::on_panel() const {
  return std::any_of(panels_.begin(), panels_.end(),
                     [this](const Box& p) { return p.contains(pointer_px_.x(), pointer_px_.y()); });
}

void WindowLoop::handle_input(double now_s) {
  const std::vector<InputEvent> events = host_->take_input();
  input_seen_ = !events.empty();
  for (const InputEvent& event : events) {
    using enum InputEvent::Kind;
    if (event.kind == key && event.pressed) controls().press_key(event.code, now_s);
    if (event.kind == close) controls().perform(Action::close, now_s);
    if (event.kind == pointer) {
      pointer_px_ = Eigen::Vector2d(event.x, event.y).cast<float>();
      moved(pointer_px_);
    }
    if (event.kind == button) {
      draw_next_ = true;  // The effect of a button is visible in the frame after the click.
      if (!event.pressed)
        released(event.code);
      else if (!on_panel())
        pressed(event.code, pointer_px_, now_s);
    }
    if (event.kind == scroll && !on_panel()) scrolled(event.y, pointer_px_);
  }
}

}  // namespace gelslam::viewer
