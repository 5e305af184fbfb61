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

/// An input of the user, or of a test. Positions are in framebuffer pixels from the top left corner.
/// `redraw`: the window system requests a redraw.
struct InputEvent {
  enum class Kind { key, pointer, button, scroll, close, redraw };
  Kind kind = Kind::key;
  int code = 0;  ///< GLFW key or mouse button
  bool pressed = false;
  double x = 0, y = 0;  ///< Pointer: position; scroll: steps in y.
};

/// A window (or an image instead of it) with OpenGL and Dear ImGui. One frame consists of take_input(),
/// begin_frame(), drawing (OpenGL into viewport(), then ImGui), end_frame(), optionally read(), and
/// present(). ImGui's unit is a framebuffer pixel. Main thread only. Throws Error when there is no display or
/// no OpenGL.
class WindowHost {
 public:
  explicit WindowHost(const WindowLoopOptions& options);
  ~WindowHost();

  void make_current();  ///< Makes its OpenGL and ImGui contexts current; needed if there are two windows.
  /// Sleeps until there is an input, at most `timeout_s`.
  void wait(double timeout_s);
  void push(const InputEvent& event) { events_.push_back(event); }
  /// Returns the inputs since the last frame in order; ImGui has received them, too. A button changes at most
  /// once per frame: inputs after a second change wait for the next frame.
  std::vector<InputEvent> take_input();
  void resize(int width_px, int height_px);  ///< For an image, not for a window.

  Viewport viewport() const { return {0, 0, width_px_, height_px_}; }
  /// Returns framebuffer pixels per design pixel, from the screen's content scale and the window's size.
  float ui_scale() const;

  void begin_frame(double dt_s);
  void end_frame();
  cv::Mat3b read();  ///< Returns BGR; to be called between end_frame() and present().
  void present();
  GLFWwindow* glfw_window() const;  ///< Null for an image.

 private:
  void install_callbacks();
  void update_size();

  std::unique_ptr<detail::GlContext> gl_;
  std::unique_ptr<detail::RenderTarget> target_;  // Used instead of a window.
  ImGuiContext* imgui_ = nullptr;
  std::deque<InputEvent> events_;
  int width_px_ = 0, height_px_ = 0;
  float pixels_per_unit_ = 1;  // framebuffer pixels per GLFW screen coordinate
};

/// Writes an image as PNG, which appears when it is complete; creates the folder. Throws Error.
void write_png(const std::filesystem::path& path, const cv::Mat3b& picture);

/// Returns "screenshot_001.png", the first such name that does not exist in the folder.
std::filesystem::path free_name(const std::filesystem::path& folder, const std::string& stem);

}  // namespace gelslam::viewer
