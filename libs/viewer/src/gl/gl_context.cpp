#include "gelslam/viewer/gl_context.hpp"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
// after epoxy, which replaces the system's GL header
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gl/gl_objects.hpp"

namespace gelslam {
namespace {

constexpr const char* kWithoutWindow =
    "--snapshot FILE draws a picture without a display; scan and calibrate work without one with "
    "--headless";

std::string glfw_reason() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text != nullptr ? text : "unknown reason";
}

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

/// A display that needs no screen: Mesa's surfaceless one, else the first device (other vendors), else the
/// default.
EGLDisplay screenless_display() {
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_base")) {
    if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless"))
      return eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    EGLDeviceEXT device = nullptr;
    EGLint count = 0;
    if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration") &&
        eglQueryDevicesEXT(1, &device, &count) == EGL_TRUE && count > 0)
      return eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr);
  }
  return eglGetDisplay(EGL_DEFAULT_DISPLAY);
}

}  // namespace

struct GlContext::Impl {
  GLFWwindow* window = nullptr;
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;

  ~Impl() {
    if (window != nullptr) {
      glfwDestroyWindow(window);
      glfwTerminate();
    }
    // The display is the process's: other contexts may live on it.
    if (context != EGL_NO_CONTEXT) {
      eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
      eglDestroyContext(display, context);
    }
  }

  bool make_current() {
    if (window != nullptr) {
      glfwMakeContextCurrent(window);
      return true;
    }
    return eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) == EGL_TRUE;
  }

  bool open_egl() {
    if (!epoxy_has_egl()) return false;
    display = screenless_display();
    if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) != EGL_TRUE) return false;
    if (!epoxy_has_egl_extension(display, "EGL_KHR_surfaceless_context")) return false;
    if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return false;
    const EGLint wanted[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (eglChooseConfig(display, wanted, &config, 1, &count) != EGL_TRUE) return false;
    const EGLint version[] = {EGL_CONTEXT_MAJOR_VERSION,
                              3,
                              EGL_CONTEXT_MINOR_VERSION,
                              3,
                              EGL_CONTEXT_OPENGL_PROFILE_MASK,
                              EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                              EGL_NONE};
    context = eglCreateContext(display, count > 0 ? config : nullptr, EGL_NO_CONTEXT, version);
    return context != EGL_NO_CONTEXT && make_current();
  }

  void open_window(const viewer::WindowLoopOptions& options, int samples) {
    // Not asked of GLFW: from version 3.4 on, Wayland's library writes to stderr when there is none.
    const std::string problem = !has_display()            ? "there is no display (DISPLAY is not set)"
                                : glfwInit() != GLFW_TRUE ? glfw_reason()
                                                          : "";
    if (!problem.empty()) throw Error("cannot open a window: " + problem + "; " + kWithoutWindow);
    create_window(options, samples);
    // Where the processor draws, several samples per pixel take it twice as long.
    if (samples > 0 && viewer::detail::is_software_renderer()) {
      glfwDestroyWindow(std::exchange(window, nullptr));
      create_window(options, 0);
    }
    glfwSwapInterval(1);
    if (!options.visible) return;
    fit_to_screen();
    glfwShowWindow(window);
  }

  /// No larger than the screen has room for, frame included: what hangs over its edge cannot be reached.
  void fit_to_screen() {
    int width = 0, height = 0, left = 0, top = 0, right = 0, bottom = 0, room_x = 0, room_y = 0,
        room_width = 0, room_height = 0;
    GLFWmonitor* monitor = glfwGetPrimaryMonitor();
    if (monitor == nullptr) return;
    glfwGetMonitorWorkarea(monitor, &room_x, &room_y, &room_width, &room_height);
    if (room_width <= 0 || room_height <= 0) return;
    glfwGetWindowFrameSize(window, &left, &top, &right, &bottom);
    glfwGetWindowSize(window, &width, &height);
    const int fitting_width = std::min(width, room_width - left - right),
              fitting_height = std::min(height, room_height - top - bottom);
    if (fitting_width == width && fitting_height == height) return;
    glfwSetWindowSize(window, fitting_width, fitting_height);
    glfwSetWindowPos(window, room_x + left, room_y + top);
  }

  void create_window(const viewer::WindowLoopOptions& options, int samples) {
    glfwDefaultWindowHints();
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
    glfwWindowHint(GLFW_SAMPLES, samples);
    glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
    glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
    window = glfwCreateWindow(options.width_px, options.height_px, options.title.c_str(), nullptr, nullptr);
    if (window == nullptr) {
      const std::string reason = glfw_reason();
      glfwTerminate();
      throw Error("cannot open a window with OpenGL 3.3: " + reason + "; " + kWithoutWindow);
    }
    glfwMakeContextCurrent(window);
  }
};

GlContext::GlContext(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
GlContext::~GlContext() = default;

std::unique_ptr<GlContext> GlContext::window(const viewer::WindowLoopOptions& options) {
  auto impl = std::make_unique<Impl>();
  impl->open_window(options, viewer::detail::kSamples);
  return std::unique_ptr<GlContext>(new GlContext(std::move(impl)));
}

std::unique_ptr<GlContext> GlContext::offscreen() {
  auto impl = std::make_unique<Impl>();
  if (!impl->open_egl()) {
    impl = std::make_unique<Impl>();
    if (!has_display())
      throw Error(
          "cannot draw: there is neither a display nor EGL; install Mesa's drivers (libegl1, "
          "libgl1-mesa-dri)");
    impl->open_window({.visible = false}, 0);
  }
  return std::unique_ptr<GlContext>(new GlContext(std::move(impl)));
}

void GlContext::make_current() {
  if (!impl_->make_current()) throw Error("the graphics driver refused its own context; is it restarting?");
}

GLFWwindow* GlContext::glfw_window() const { return impl_->window; }

std::string GlContext::renderer() const {
  const auto text = [](GLenum name) {
    const auto* value = reinterpret_cast<const char*>(glGetString(name));
    return std::string(value != nullptr ? value : "unknown");
  };
  return text(GL_RENDERER) + ", OpenGL " + text(GL_VERSION);
}

bool has_display() { return is_set("DISPLAY") || is_set("WAYLAND_DISPLAY"); }

using namespace viewer::detail;

struct RenderTarget::Impl {
  int width, height;
  GlFramebuffer drawing, resolved;
  GlRenderbuffer color, depth, resolved_color;
};

RenderTarget::RenderTarget(int width_px, int height_px) {
  if (std::min(width_px, height_px) < 1 || std::max(width_px, height_px) > kMaxSidePx) {
    throw Error("cannot draw a picture of " + std::to_string(width_px) + "x" + std::to_string(height_px) +
                " pixels: each side must be 1 to " + std::to_string(kMaxSidePx));
  }
  impl_ = std::make_unique<Impl>(Impl{width_px, height_px, {}, {}, {}, {}, {}});
  GLint most = 0;
  glGetIntegerv(GL_MAX_SAMPLES, &most);
  const GLsizei used = std::min(kSamples, most);
  const auto attach = [&](const GlRenderbuffer& buffer, GLenum format, GLsizei of_samples, GLenum place) {
    glBindRenderbuffer(GL_RENDERBUFFER, buffer.name());
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, of_samples, format, width_px, height_px);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, place, GL_RENDERBUFFER, buffer.name());
  };
  glBindFramebuffer(GL_FRAMEBUFFER, impl_->resolved.name());
  attach(impl_->resolved_color, GL_RGBA8, 0, GL_COLOR_ATTACHMENT0);
  glBindFramebuffer(GL_FRAMEBUFFER, impl_->drawing.name());
  attach(impl_->color, GL_RGBA8, used, GL_COLOR_ATTACHMENT0);
  attach(impl_->depth, GL_DEPTH_COMPONENT24, used, GL_DEPTH_ATTACHMENT);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw Error("the graphics driver cannot draw a picture of " + std::to_string(width_px) + "x" +
                std::to_string(height_px) + " pixels; try a smaller one");
  }
}

RenderTarget::~RenderTarget() = default;

void RenderTarget::bind() {
  glBindFramebuffer(GL_FRAMEBUFFER, impl_->drawing.name());
  glViewport(0, 0, impl_->width, impl_->height);
}

cv::Mat3b RenderTarget::read() {
  const int w = impl_->width, h = impl_->height;
  glBindFramebuffer(GL_READ_FRAMEBUFFER, impl_->drawing.name());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, impl_->resolved.name());
  glBlitFramebuffer(0, 0, w, h, 0, 0, w, h, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, impl_->resolved.name());
  cv::Mat rgba(h, w, CV_8UC4);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  glPixelStorei(GL_PACK_ROW_LENGTH, 0);
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glReadPixels(0, 0, w, h, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data);
  bind();
  cv::Mat bgr, upright;
  cv::cvtColor(rgba, bgr, cv::COLOR_RGBA2BGR);
  cv::flip(bgr, upright, 0);
  return upright;
}

}  // namespace gelslam
