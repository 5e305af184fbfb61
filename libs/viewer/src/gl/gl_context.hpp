#pragma once

#include <epoxy/egl.h>

#include <memory>
#include <opencv2/core/mat.hpp>

#include "gelslam/viewer/window_options.hpp"
#include "gl/gl_objects.hpp"

struct GLFWwindow;

namespace gelslam::viewer::detail {

/// An OpenGL 3.3 core context, current on the thread that made it until another one is made current. One
/// thread only.
class GlContext {
 public:
  /// A window on the main thread (GLFW), swaps tied to the screen's rate; hidden where options.visible is
  /// false. Throws Error, with what to do instead, when there is no display or no OpenGL 3.3.
  static std::unique_ptr<GlContext> window(const WindowLoopOptions& options);
  /// Without display or window: EGL without a surface, else a hidden window. There is nothing to draw into
  /// but a RenderTarget. Throws Error when neither works.
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

/// A picture to draw into instead of a window: color and depth, several samples per pixel. Needs a current
/// context.
class RenderTarget {
 public:
  /// Throws Error when a side is not within 1 to 8192 or the driver has no memory for it.
  RenderTarget(int width_px, int height_px);

  /// All drawing goes here, viewport included, until another framebuffer is bound.
  void bind();
  /// What has been drawn, 8-bit BGR, top row first. The target stays bound.
  cv::Mat3b read();

 private:
  const int width_, height_;
  GlFramebuffer drawing_, resolved_;
  GlRenderbuffer color_, depth_, resolved_color_;
};

}  // namespace gelslam::viewer::detail
