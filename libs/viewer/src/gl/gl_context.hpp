#pragma once

#include <epoxy/egl.h>

#include <memory>
#include <opencv2/core/mat.hpp>

#include "gelslam/viewer/window_options.hpp"
#include "gl/gl_objects.hpp"

struct GLFWwindow;

namespace gelslam::viewer::detail {

/// An OpenGL 3.3 core context. It is current in the thread that created it until another one is made current.
/// To be used by one thread.
class GlContext {
 public:
  /// Creates a window on the main thread (GLFW) with swaps synchronized to the screen; hidden if
  /// options.visible is false. Throws Error, with advice, when there is no display or no OpenGL 3.3.
  static std::unique_ptr<GlContext> window(const WindowLoopOptions& options);
  /// Creates a context without display or window: EGL without a surface, else a hidden window. Drawing is
  /// possible only into a RenderTarget. Throws Error when neither works.
  static std::unique_ptr<GlContext> offscreen();

  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  void make_current();
  GLFWwindow* glfw_window() const { return window_; }  ///< null for EGL

 private:
  GlContext();
  bool open_egl();
  void open_window(const WindowLoopOptions& options, int samples);
  void create_window(const WindowLoopOptions& options, int samples);
  void fit_to_screen();

  GLFWwindow* window_ = nullptr;
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

/// An image to draw into instead of a window: color and depth, several samples per pixel. Needs a current
/// context.
class RenderTarget {
 public:
  /// Throws Error when a side is not within 1 to 8192 or the driver has no memory for it.
  RenderTarget(int width_px, int height_px);

  /// Directs all drawing here, viewport included, until another framebuffer is bound.
  void bind();
  /// Returns the drawn image, 8-bit BGR, top row first. The target stays bound.
  cv::Mat3b read();

 private:
  const int width_, height_;
  GlFramebuffer drawing_, resolved_;
  GlRenderbuffer color_, depth_, resolved_color_;
};

}  // namespace gelslam::viewer::detail
