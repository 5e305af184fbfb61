#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

#include "gelslam/viewer/window_options.hpp"

struct GLFWwindow;

namespace gelslam {

/// True when the environment names a display that a window could open on.
bool has_display();

/// An OpenGL 3.3 core context, current on the thread that made it until another one is made current. One
/// thread only.
class GlContext {
 public:
  /// A window on the main thread (GLFW), swaps tied to the screen's rate; hidden where options.visible is
  /// false. Throws Error, with what to do instead, when there is no display or no OpenGL 3.3.
  static std::unique_ptr<GlContext> window(const viewer::WindowLoopOptions& options);
  /// Without display or window: EGL without a surface, else a hidden window. There is nothing to draw into
  /// but a RenderTarget. Throws Error when neither works.
  static std::unique_ptr<GlContext> offscreen();

  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  void make_current();
  GLFWwindow* glfw_window() const;  ///< null for EGL
  std::string renderer() const;  ///< what draws, for people: "llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5"

 private:
  struct Impl;
  explicit GlContext(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// A picture to draw into instead of a window: color and depth, several samples per pixel. Needs a current
/// context.
class RenderTarget {
 public:
  static constexpr int kMaxSidePx = 8192;

  /// Throws Error when a side is not within 1 to kMaxSidePx or the driver has no memory for it.
  RenderTarget(int width_px, int height_px);
  ~RenderTarget();
  RenderTarget(const RenderTarget&) = delete;
  RenderTarget& operator=(const RenderTarget&) = delete;

  /// All drawing goes here, viewport included, until another framebuffer is bound.
  void bind();
  /// What has been drawn, 8-bit BGR, top row first. The target stays bound.
  cv::Mat3b read();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
