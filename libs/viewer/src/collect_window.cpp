#define GLFW_INCLUDE_NONE  // epoxy brings OpenGL
#include "gelslam/viewer/collect_window.hpp"

#include <GLFW/glfw3.h>
#include <epoxy/gl.h>

#include "collect_panels.hpp"
#include "window_host.hpp"

namespace gelslam {
namespace {

using namespace viewer::detail;

constexpr double frame_s = 1.0 / 30;

/// The window of `gelslam calibrate collect`, frame by frame.
class CollectLoop {
 public:
  CollectLoop(CollectWatch& session, const CollectWindowOptions& options)
      : session_(session),
        options_(options),
        host_({options.title, options.width_px, options.height_px, options.visible}) {}
  ~CollectLoop() { host_.make_current(); }  // what was drawn with is freed there
  CollectLoop(const CollectLoop&) = delete;
  CollectLoop& operator=(const CollectLoop&) = delete;

  void run() {
    bool closes = false;
    while (!closes) {
      closes = handle_input();
      const CollectView view = session_.view();
      closes = closes || view.closes;
      draw(view, closes && !options_.snapshot.empty());
      if (!closes) host_.wait(frame_s);
    }
  }

  void draw(const CollectView& view, bool keep) {
    host_.begin_frame(frame_s);
    const cv::Mat3b picture = collect_picture(view);
    if (!picture.empty()) texture_.set(picture);
    const Viewport whole = host_.viewport();
    glViewport(0, 0, whole.width, whole.height);
    glClearColor(0.055F, 0.063F, 0.075F, 1.0F);
    glClear(GL_COLOR_BUFFER_BIT);
    {
      Canvas canvas(host_.ui_scale());
      draw_collect_panels(canvas, {0, 0, static_cast<float>(whole.width), static_cast<float>(whole.height)},
                          texture_, view);
    }
    host_.end_frame();
    if (keep) write_png(options_.snapshot.string(), host_.read());
    host_.present();
  }

 private:
  /// True when the person wants to close.
  bool handle_input() {
    bool closes = false;
    for (const InputEvent& event : host_.take_input()) {
      if (event.kind == InputEvent::Kind::close) closes = true;
      if (event.kind != InputEvent::Kind::key || !event.pressed) continue;
      if (event.code == GLFW_KEY_Q || event.code == GLFW_KEY_ESCAPE) closes = true;
      if (event.code == GLFW_KEY_U) session_.take_back();
    }
    return closes;
  }

  CollectWatch& session_;
  CollectWindowOptions options_;
  WindowHost host_;
  WindowTexture texture_;
};

}  // namespace

void run_collect_window(CollectWatch& session, const CollectWindowOptions& options) {
  CollectLoop(session, options).run();
}

void write_collect_snapshot(CollectWatch& session, const CollectWindowOptions& options) {
  CollectWindowOptions hidden = options;
  hidden.visible = false;
  CollectLoop(session, hidden).draw(session.view(), true);
}

}  // namespace gelslam
