#include "gelslam/viewer/window_host.hpp"

#include <epoxy/gl.h>
#include <fmt/core.h>
// Included after epoxy, which replaces the system's GL header.
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "gelslam/core/error.hpp"
#include "gelslam/image/codecs.hpp"
#include "gelslam/viewer/ui.hpp"
#include "gl/gl_context.hpp"

namespace gelslam::viewer {
namespace {

WindowHost& host_of(GLFWwindow* window) {
  return *static_cast<WindowHost*>(glfwGetWindowUserPointer(window));
}

/// Sizes in design pixels from small to large, in the order of the font atlas.
constexpr std::array<float, 5> kFontSizes = {14, 17, 22, 21, 46};

/// Latin with accents, Greek and Cyrillic (for names of folders), and a few symbols.
constexpr std::array<ImWchar, 13> kManyLetters = {0x20,  0xFF,   0x100,  0x17F,  0x370,  0x3FF, 0x400,
                                                  0x4FF, 0x2010, 0x2026, 0x2190, 0x2193, 0};
constexpr std::array<ImWchar, 5> kFewLetters = {0x20, 0xFF, 0x2010, 0x2026, 0};

/// Returns a font of the system, or the one beside the program.
std::string find_face(const std::string& weight) {
  const std::string dejavu = weight == "Bold" ? "DejaVuSans-Bold.ttf" : "DejaVuSans.ttf";
  std::error_code code;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", code);
  for (const std::string& path :
       {"/usr/share/fonts/opentype/inter/Inter-" + weight + ".otf",
        "/usr/share/fonts/truetype/noto/NotoSans-" + weight + ".ttf",
        "/usr/share/fonts/truetype/dejavu/" + dejavu, "/usr/share/fonts/TTF/" + dejavu,
        "/usr/share/fonts/dejavu-sans-fonts/" + dejavu,
        (program.parent_path() / "../share" / dejavu).string(),
        "/usr/share/fonts/truetype/liberation/LiberationSans-" + weight + ".ttf"})
    if (std::filesystem::is_regular_file(path, code)) return path;
  return "";
}

void apply_theme(ImGuiStyle& style) {
  ImGui::StyleColorsDark(&style);
  style.WindowRounding = style.FrameRounding = style.PopupRounding = style.GrabRounding = 6;
  style.WindowBorderSize = style.FrameBorderSize = 0;
  style.PopupBorderSize = 1;
  style.WindowMinSize = ImVec2(1, 1);
  style.ItemSpacing = style.CellPadding = ImVec2(0, 0);
  const auto set = [&style](ImGuiCol which, ImU32 color) {
    style.Colors[which] = ImGui::ColorConvertU32ToFloat4(color);
  };
  set(ImGuiCol_Text, theme::kText);
  set(ImGuiCol_WindowBg, theme::kPanel);
  set(ImGuiCol_PopupBg, theme::kPanel);
  set(ImGuiCol_Border, theme::kLine);
  set(ImGuiCol_ModalWindowDimBg, theme::rgb(8, 10, 12, 150));
}

/// Loads the fonts of the current ImGui context for a scale, in the order of Face, if they are not loaded
/// yet. Returns true when they replace others, so that their texture must be uploaded. Uses a common font if
/// one is installed, else ImGui's own.
bool load_fonts(float scale) {
  ImFontAtlas& atlas = *ImGui::GetIO().Fonts;
  const float body_px = std::round(kFontSizes[1] * scale);
  if (!atlas.Fonts.empty() && atlas.Fonts[1]->ConfigData->SizePixels == body_px) return false;
  const bool reload = !atlas.Fonts.empty();
  atlas.Clear();
  const std::string regular = find_face("Regular"), bold = find_face("Bold");
  for (std::size_t i = 0; i < kFontSizes.size(); ++i) {
    const bool bold_letters = i >= 3;
    const std::string& face = bold_letters && !bold.empty() ? bold : regular;
    const float size_px = std::round(kFontSizes[i] * scale);
    const ImWchar* letters = bold_letters ? kFewLetters.data() : kManyLetters.data();
    ImFont* font = face.empty() ? nullptr : atlas.AddFontFromFileTTF(face.c_str(), size_px, nullptr, letters);
    if (font == nullptr) {  // The font does not exist, or its file is damaged.
      ImFontConfig config;
      config.SizePixels = size_px;
      atlas.AddFontDefault(&config);
    }
  }
  atlas.Build();
  return reload;
}

}  // namespace

WindowHost::WindowHost(const WindowLoopOptions& options)
    : gl_(options.visible ? detail::GlContext::window(options) : detail::GlContext::offscreen()),
      width_px_(options.width_px),
      height_px_(options.height_px) {
  if (!options.visible) target_ = std::make_unique<detail::RenderTarget>(width_px_, height_px_);
  imgui_ = ImGui::CreateContext();
  ImGui::SetCurrentContext(imgui_);
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;  // No file is written.
  io.LogFilename = nullptr;
  io.MousePos = ImVec2(-1, -1);
  apply_theme(ImGui::GetStyle());
  update_size();
  load_fonts(ui_scale());
  if (!ImGui_ImplOpenGL3_Init("#version 330 core")) throw Error("cannot draw text with this OpenGL driver");
  if (options.visible) install_callbacks();
}

WindowHost::~WindowHost() {
  make_current();
  ImGui_ImplOpenGL3_Shutdown();
  ImGui::DestroyContext(imgui_);
}

void WindowHost::make_current() {
  gl_->make_current();
  ImGui::SetCurrentContext(imgui_);
}

void WindowHost::install_callbacks() {
  GLFWwindow* window = glfw_window();
  glfwSetWindowUserPointer(window, this);
  glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int, int action, int) {
    if (action != GLFW_REPEAT) host_of(w).push({InputEvent::Kind::key, key, action == GLFW_PRESS});
  });
  glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) {
    const double ratio = host_of(w).pixels_per_unit_;
    host_of(w).push({InputEvent::Kind::pointer, 0, false, x * ratio, y * ratio});
  });
  glfwSetMouseButtonCallback(window, [](GLFWwindow* w, int button, int action, int) {
    host_of(w).push({InputEvent::Kind::button, button, action == GLFW_PRESS});
  });
  glfwSetScrollCallback(window, [](GLFWwindow* w, double x, double y) {
    host_of(w).push({InputEvent::Kind::scroll, 0, false, x, y});
  });
  glfwSetWindowCloseCallback(window, [](GLFWwindow* w) {
    glfwSetWindowShouldClose(w, GLFW_FALSE);  // Whether the window closes is decided by the user's answer.
    host_of(w).push({InputEvent::Kind::close});
  });
  glfwSetWindowRefreshCallback(window, [](GLFWwindow* w) { host_of(w).push({InputEvent::Kind::redraw}); });
  glfwSetFramebufferSizeCallback(
      window, [](GLFWwindow* w, int, int) { host_of(w).push({InputEvent::Kind::redraw}); });
}

void WindowHost::wait(double timeout_s) {
  if (target_ == nullptr) return timeout_s > 0 ? glfwWaitEventsTimeout(timeout_s) : glfwPollEvents();
  if (timeout_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(timeout_s));
}

std::vector<InputEvent> WindowHost::take_input() {
  make_current();
  ImGuiIO& io = ImGui::GetIO();
  std::vector<InputEvent> taken;
  std::array<bool, GLFW_MOUSE_BUTTON_LAST + 1> changed{};
  while (!events_.empty()) {
    const InputEvent event = events_.front();
    if (event.kind == InputEvent::Kind::button && event.code >= 0 && event.code <= GLFW_MOUSE_BUTTON_LAST) {
      if (std::exchange(changed[static_cast<std::size_t>(event.code)], true)) break;
      if (event.code < IM_ARRAYSIZE(io.MouseDown)) io.MouseDown[event.code] = event.pressed;
    } else if (event.kind == InputEvent::Kind::pointer) {
      io.MousePos = ImVec2(static_cast<float>(event.x), static_cast<float>(event.y));
    } else if (event.kind == InputEvent::Kind::scroll) {
      io.MouseWheel += static_cast<float>(event.y);
    }
    taken.push_back(event);
    events_.pop_front();
  }
  return taken;
}

void WindowHost::resize(int width_px, int height_px) {
  target_ = std::make_unique<detail::RenderTarget>(width_px, height_px);
  width_px_ = width_px;
  height_px_ = height_px;
}

void WindowHost::update_size() {
  if (target_) return;
  int unit_width = 1, unit_height = 1;
  glfwGetFramebufferSize(gl_->glfw_window(), &width_px_, &height_px_);
  glfwGetWindowSize(gl_->glfw_window(), &unit_width, &unit_height);
  pixels_per_unit_ = unit_width > 0 ? static_cast<float>(width_px_) / static_cast<float>(unit_width) : 1.0F;
  width_px_ = std::max(1, width_px_);  // The window is minimized.
  height_px_ = std::max(1, height_px_);
}

float WindowHost::ui_scale() const {
  float content = 1, ignored = 1;
  if (!target_) glfwGetWindowContentScale(gl_->glfw_window(), &content, &ignored);
  const float size =
      std::min(static_cast<float>(width_px_) / 1280.0F, static_cast<float>(height_px_) / 800.0F);
  // The font size grows with the window, as users stand further away from large ones. It has a lower limit
  // for legibility, and changes in steps, so that resizing does not load fonts for every pixel.
  return std::round(8 * std::clamp(size, 0.75F * content, 2.5F * content)) / 8;
}

void WindowHost::begin_frame(double dt_s) {
  make_current();
  update_size();
  if (load_fonts(ui_scale())) {
    ImGui_ImplOpenGL3_DestroyFontsTexture();
    ImGui_ImplOpenGL3_CreateFontsTexture();
  }
  if (target_) {
    target_->bind();
  } else {
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, width_px_, height_px_);
  }
  ImGuiIO& io = ImGui::GetIO();
  io.DisplaySize = ImVec2(static_cast<float>(width_px_), static_cast<float>(height_px_));
  io.DeltaTime = static_cast<float>(std::max(dt_s, 1e-4));
  ImGui_ImplOpenGL3_NewFrame();
  ImGui::NewFrame();
}

void WindowHost::end_frame() {
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

cv::Mat3b WindowHost::read() {
  if (target_) return target_->read();
  glReadBuffer(GL_BACK);
  return detail::read_pixels(width_px_, height_px_);
}

void WindowHost::present() {
  if (!target_) glfwSwapBuffers(gl_->glfw_window());
}

GLFWwindow* WindowHost::glfw_window() const { return target_ ? nullptr : gl_->glfw_window(); }

void write_png(const std::filesystem::path& path, const cv::Mat3b& picture) {
  std::error_code code;
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), code);
  gelslam::write_png(path, picture);
}

std::filesystem::path free_name(const std::filesystem::path& folder, const std::string& stem) {
  for (int number = 1;; ++number) {
    const std::filesystem::path path = folder / fmt::format("{}_{:03}.png", stem, number);
    std::error_code code;
    if (!std::filesystem::exists(path, code)) return path;
  }
}

}  // namespace gelslam::viewer
