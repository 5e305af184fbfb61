#pragma once

#include <deque>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "gelslam/viewer/orbit_camera.hpp"
#include "gelslam/viewer/window_options.hpp"

struct GLFWwindow;
struct ImGuiContext;

namespace gelslam::viewer {

namespace detail {
class GlContext;
class RenderTarget;
}  // namespace detail

/// What a person did, or a test in their place. Positions in framebuffer pixels from the top left corner.
/// `redraw`: the window system asks for the picture again.
struct InputEvent {
  enum class Kind { key, pointer, button, scroll, close, redraw };
  Kind kind = Kind::key;
  int code = 0;  ///< GLFW key or mouse button
  bool pressed = false;
  double x = 0, y = 0;  ///< pointer: where; scroll: steps in y
};

/// A window (or a picture in its place) with OpenGL and Dear ImGui in it. One frame is: take_input(),
/// begin_frame(), draw (OpenGL into viewport(), then ImGui), end_frame(), perhaps read(), present(). ImGui's
/// unit is a framebuffer pixel. Main thread only. Throws Error where there is no display or no OpenGL.
class WindowHost {
 public:
  explicit WindowHost(const WindowLoopOptions& options);
  ~WindowHost();

  void make_current();  ///< OpenGL and ImGui: where there are two windows
  /// Sleeps until something is done in the window, at most `timeout_s`.
  void wait(double timeout_s);
  void push(const InputEvent& event) { events_.push_back(event); }
  /// What was done since the last frame, in order; ImGui has seen it too. A button changes once per frame,
  /// however fast it was: what follows a second change waits for the next frame.
  std::vector<InputEvent> take_input();
  void resize(int width_px, int height_px);  ///< a picture, not a window

  Viewport viewport() const { return {0, 0, width_px_, height_px_}; }
  /// Framebuffer pixels per design pixel, by the screen's content scale and the window's size.
  float ui_scale() const;

  void begin_frame(double dt_s);
  void end_frame();
  cv::Mat3b read();  ///< BGR; between end_frame() and present()
  void present();
  GLFWwindow* glfw_window() const;  ///< null when it is a picture

 private:
  void install_callbacks();
  void update_size();

  std::unique_ptr<detail::GlContext> gl_;
  std::unique_ptr<detail::RenderTarget> target_;  // in place of a window
  ImGuiContext* imgui_ = nullptr;
  std::deque<InputEvent> events_;
  int width_px_ = 0, height_px_ = 0;
  float pixels_per_unit_ = 1;  // framebuffer pixels per GLFW screen coordinate
};

/// Writes a picture as PNG, to a temporary name that is renamed when whole; makes the folder. Throws Error.
void write_png(const std::filesystem::path& path, const cv::Mat3b& picture);

/// "screenshot_001.png": the first name of this kind that is not taken in the folder.
std::filesystem::path free_name(const std::filesystem::path& folder, const std::string& stem);

}  // namespace gelslam::viewer
