#include "gl/gl_context.hpp"

#include <dlfcn.h>
#include <epoxy/gl.h>
// Included after epoxy, which replaces the system's GL header.
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cstdlib>
#include <new>
#include <string_view>
#include <thread>
#include <utility>

#include "gelslam/core/error.hpp"

namespace gelslam::viewer {
namespace detail {
namespace {

constexpr int kSamples = 4;  // Samples per pixel.

constexpr const char* kWithoutWindow =
    "--snapshot FILE draws a picture without a display; scan and calibrate work without one with "
    "--headless";

std::string glfw_reason() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text != nullptr ? text : "unknown reason";
}

/// Says whether the environment names a display.
bool has_display() {
  const auto is_set = [](const char* variable) {
    const char* value = std::getenv(variable);
    return value != nullptr && *value != '\0';
  };
  return is_set("DISPLAY") || is_set("WAYLAND_DISPLAY");
}

/// Says whether the renderer is Mesa's software renderer.
bool is_software_renderer() {
  const auto* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  const std::string_view renderer = name != nullptr ? name : "";
  return renderer.find("llvmpipe") != renderer.npos || renderer.find("softpipe") != renderer.npos;
}

/// Returns a display that needs no screen: Mesa's surfaceless one, else the first device (other vendors),
/// else the default.
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

GlContext::~GlContext() {
  if (window_ != nullptr) {
    glfwDestroyWindow(window_);
    glfwTerminate();
  }
  // The display belongs to the process, and other contexts may use it.
  if (context_ != EGL_NO_CONTEXT) {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display_, context_);
  }
}

bool GlContext::open_egl() {
  if (!epoxy_has_egl()) return false;
  display_ = screenless_display();
  if (display_ == EGL_NO_DISPLAY || eglInitialize(display_, nullptr, nullptr) != EGL_TRUE) return false;
  if (!epoxy_has_egl_extension(display_, "EGL_KHR_surfaceless_context")) return false;
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return false;
  const EGLint wanted[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (eglChooseConfig(display_, wanted, &config, 1, &count) != EGL_TRUE) return false;
  const EGLint version[] = {EGL_CONTEXT_MAJOR_VERSION,
                            3,
                            EGL_CONTEXT_MINOR_VERSION,
                            3,
                            EGL_CONTEXT_OPENGL_PROFILE_MASK,
                            EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                            EGL_NONE};
  context_ = eglCreateContext(display_, count > 0 ? config : nullptr, EGL_NO_CONTEXT, version);
  return context_ != EGL_NO_CONTEXT &&
         eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_TRUE;
}

void GlContext::open_window(const WindowLoopOptions& options, int samples) {
  // GLFW is not asked, because from version 3.4 on, the Wayland library prints an error if there is no
  // display.
  const std::string problem = !has_display()            ? "there is no display (DISPLAY is not set)"
                              : glfwInit() != GLFW_TRUE ? glfw_reason()
                                                        : "";
  if (!problem.empty()) throw Error("cannot open a window: " + problem + "; " + kWithoutWindow);
  create_window(options, samples);
  // With a software renderer, several samples per pixel take twice the time.
  if (samples > 0 && is_software_renderer()) {
    glfwDestroyWindow(std::exchange(window_, nullptr));
    create_window(options, 0);
  }
  glfwSwapInterval(1);
  if (!options.visible) return;
  fit_to_screen();
  glfwShowWindow(window_);
}

/// Limits the window, with its frame, to the size of the screen, because parts beyond its edge cannot be
/// reached.
void GlContext::fit_to_screen() {
  int width = 0, height = 0, left = 0, top = 0, right = 0, bottom = 0, room_x = 0, room_y = 0, room_width = 0,
      room_height = 0;
  GLFWmonitor* monitor = glfwGetPrimaryMonitor();
  if (monitor == nullptr) return;
  glfwGetMonitorWorkarea(monitor, &room_x, &room_y, &room_width, &room_height);
  if (room_width <= 0 || room_height <= 0) return;
  glfwGetWindowFrameSize(window_, &left, &top, &right, &bottom);
  glfwGetWindowSize(window_, &width, &height);
  const int fitting_width = std::min(width, room_width - left - right),
            fitting_height = std::min(height, room_height - top - bottom);
  if (fitting_width == width && fitting_height == height) return;
  glfwSetWindowSize(window_, fitting_width, fitting_height);
  glfwSetWindowPos(window_, room_x + left, room_y + top);
}

void GlContext::create_window(const WindowLoopOptions& options, int samples) {
  glfwDefaultWindowHints();
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  glfwWindowHint(GLFW_SAMPLES, samples);
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
  window_ = glfwCreateWindow(options.width_px, options.height_px, options.title.c_str(), nullptr, nullptr);
  if (window_ == nullptr) {
    const std::string reason = glfw_reason();
    glfwTerminate();
    throw Error("cannot open a window with OpenGL 3.3: " + reason + "; " + kWithoutWindow);
  }
  glfwMakeContextCurrent(window_);
}

/// Throws std::bad_alloc if there is less memory than Mesa's software renderer needs with its threads,
/// because it ends the program when it gets none.
GlContext::GlContext() {
  ::operator delete(::operator new((512 + 64 * std::size_t{std::thread::hardware_concurrency()}) << 20));
}

std::unique_ptr<GlContext> GlContext::window(const WindowLoopOptions& options) {
  std::unique_ptr<GlContext> context(new GlContext);
  context->open_window(options, kSamples);
  return context;
}

std::unique_ptr<GlContext> GlContext::offscreen() {
  std::unique_ptr<GlContext> context(new GlContext);
  if (context->open_egl()) return context;
  context.reset(new GlContext);
  if (!has_display())
    throw Error(
        "cannot draw: there is neither a display nor EGL; install Mesa's drivers (libegl1, "
        "libgl1-mesa-dri)");
  context->open_window({.visible = false}, 0);
  return context;
}

void GlContext::make_current() {
  if (window_ != nullptr) return glfwMakeContextCurrent(window_);
  if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) != EGL_TRUE)
    throw Error("the graphics driver refused its own context; is it restarting?");
}

RenderTarget::RenderTarget(int width_px, int height_px) : width_(width_px), height_(height_px) {
  constexpr int kMaxSidePx = 8192;
  const auto refuse = [&](const std::string& whose, const std::string& why) {
    throw Error(whose + " draw a picture of " + std::to_string(width_px) + "x" + std::to_string(height_px) +
                " pixels" + why);
  };
  if (std::min(width_px, height_px) < 1 || std::max(width_px, height_px) > kMaxSidePx)
    refuse("cannot", ": each side must be 1 to " + std::to_string(kMaxSidePx));
  GLint most = 0;
  glGetIntegerv(GL_MAX_SAMPLES, &most);
  const GLsizei used = std::min(kSamples, most);
  const auto attach = [&](const GlRenderbuffer& buffer, GLenum format, GLsizei of_samples, GLenum place) {
    glBindRenderbuffer(GL_RENDERBUFFER, buffer.name());
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, of_samples, format, width_px, height_px);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, place, GL_RENDERBUFFER, buffer.name());
  };
  glBindFramebuffer(GL_FRAMEBUFFER, resolved_.name());
  attach(resolved_color_, GL_RGBA8, 0, GL_COLOR_ATTACHMENT0);
  glBindFramebuffer(GL_FRAMEBUFFER, drawing_.name());
  attach(color_, GL_RGBA8, used, GL_COLOR_ATTACHMENT0);
  attach(depth_, GL_DEPTH_COMPONENT24, used, GL_DEPTH_ATTACHMENT);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    refuse("the graphics driver cannot", "; try a smaller one");
}

void RenderTarget::bind() {
  glBindFramebuffer(GL_FRAMEBUFFER, drawing_.name());
  glViewport(0, 0, width_, height_);
}

cv::Mat3b RenderTarget::read() {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, drawing_.name());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, resolved_.name());
  glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, resolved_.name());
  cv::Mat3b picture = read_pixels(width_, height_);
  bind();
  return picture;
}

}  // namespace detail

void require_display() { detail::GlContext::window({.visible = false}); }

void before_display_loss_ends_it(std::function<void()> work) {
  static std::function<void()> wanted;
  wanted = std::move(work);
  void* xlib = dlopen("libX11.so.6", RTLD_LAZY | RTLD_NOLOAD);  // The library that GLFW has loaded.
  using SetHandler = void (*)(int (*)(void*));
  const auto set_handler =
      xlib != nullptr ? reinterpret_cast<SetHandler>(dlsym(xlib, "XSetIOErrorHandler")) : nullptr;
  if (set_handler != nullptr)
    set_handler([](void*) {
      if (wanted) wanted();
      std::_Exit(1);  // exit(), which Xlib's handler calls, would destroy objects that other threads use.
      return 0;
    });
}

}  // namespace gelslam::viewer
