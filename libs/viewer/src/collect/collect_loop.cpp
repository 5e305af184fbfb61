#define GLFW_INCLUDE_NONE  // epoxy brings OpenGL
#include "collect/collect_loop.hpp"

#include <GLFW/glfw3.h>
#include <epoxy/gl.h>

#include "collect/collect_panels.hpp"

namespace gelslam {
namespace viewer::detail {
namespace {

constexpr double frame_s = 1.0 / 30;

}  // namespace

CollectLoop::CollectLoop(CollectWatch& session, const CollectWindowOptions& options)
    : session_(session),
      options_(options),
      host_({options.title, options.width_px, options.height_px, options.visible}) {}

void CollectLoop::run() {
  while (turn()) host_.wait(frame_s);
  if (!options_.snapshot.empty()) write_png(options_.snapshot.string(), picture());
}

bool CollectLoop::turn() {
  const bool closed = handle_input();
  const CollectView view = session_.view();
  draw(view);
  host_.present();
  return !closed && !view.closes;
}

cv::Mat3b CollectLoop::picture() {
  host_.want_picture();
  draw(session_.view());
  host_.present();
  return host_.take_picture();
}

/// True when the person wants to close.
bool CollectLoop::handle_input() {
  bool closes = false;
  for (const InputEvent& event : host_.take_input()) {
    if (event.kind == InputEvent::Kind::close) closes = true;
    if (event.kind != InputEvent::Kind::key || !event.pressed) continue;
    if (event.code == GLFW_KEY_Q || event.code == GLFW_KEY_ESCAPE) closes = true;
    if (event.code == GLFW_KEY_U) session_.take_back();
  }
  return closes;
}

void CollectLoop::draw(const CollectView& view) {
  host_.begin_frame(frame_s);
  if (const cv::Mat3b picture = collect_picture(view); !picture.empty()) texture_.set(picture);
  const Viewport whole = host_.viewport();
  glViewport(0, 0, whole.width, whole.height);
  glClearColor(0.055F, 0.063F, 0.075F, 1.0F);
  glClear(GL_COLOR_BUFFER_BIT);
  {
    Canvas canvas(host_.ui_scale());
    const Box window{0, 0, static_cast<float>(whole.width), static_cast<float>(whole.height)};
    draw_collect_panels(canvas, window, texture_, view);
    texts_ = canvas.take_texts();
  }
  host_.end_frame();
}

}  // namespace viewer::detail

void run_collect_window(CollectWatch& session, const CollectWindowOptions& options) {
  viewer::detail::CollectLoop(session, options).run();
}

void write_collect_snapshot(CollectWatch& session, const CollectWindowOptions& options) {
  CollectWindowOptions hidden = options;
  hidden.visible = false;
  viewer::detail::write_png(options.snapshot.string(),
                            viewer::detail::CollectLoop(session, hidden).picture());
}

}  // namespace gelslam
