#include "ui/window_theme.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>

namespace gelslam::viewer::detail {
namespace {

/// Sizes in design pixels, small to large: the order in the atlas.
constexpr std::array<float, 5> font_sizes = {14, 17, 22, 21, 46};

/// Latin with accents, Greek and Cyrillic (names of folders), and a few signs.
constexpr std::array<ImWchar, 13> many_letters = {0x20,  0xFF,   0x100,  0x17F,  0x370,  0x3FF, 0x400,
                                                  0x4FF, 0x2010, 0x2026, 0x2190, 0x2193, 0};
constexpr std::array<ImWchar, 5> few_letters = {0x20, 0xFF, 0x2010, 0x2026, 0};

std::string first_existing(std::initializer_list<const char*> paths) {
  for (const char* path : paths) {
    std::error_code code;
    if (std::filesystem::is_regular_file(path, code)) return path;
  }
  return "";
}

std::string regular_face() {
  return first_existing({"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
                         "/usr/share/fonts/TTF/DejaVuSans.ttf",
                         "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf",
                         "/usr/share/fonts/truetype/liberation/LiberationSans-Regular.ttf",
                         "/usr/share/fonts/truetype/noto/NotoSans-Regular.ttf"});
}

std::string bold_face() {
  return first_existing({"/usr/share/fonts/truetype/dejavu/DejaVuSans-Bold.ttf",
                         "/usr/share/fonts/TTF/DejaVuSans-Bold.ttf",
                         "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans-Bold.ttf",
                         "/usr/share/fonts/truetype/liberation/LiberationSans-Bold.ttf",
                         "/usr/share/fonts/truetype/noto/NotoSans-Bold.ttf"});
}

}  // namespace

ImU32 theme::of_state(LiveState state) {
  switch (state) {
    case LiveState::tracking:
      return green;
    case LiveState::no_contact:
      return amber;
    case LiveState::lost:
      return red;
    case LiveState::paused:
      return gray;
    case LiveState::background:
    case LiveState::finishing:
      return blue;
    case LiveState::finished:
      return green;
  }
  return gray;
}

ImU32 theme::with_alpha(ImU32 color, double alpha) {
  const auto byte = static_cast<ImU32>(std::lround(255 * std::clamp(alpha, 0.0, 1.0)));
  return (color & ~IM_COL32_A_MASK) | (byte << IM_COL32_A_SHIFT);
}

void apply_theme(ImGuiStyle& style) {
  ImGui::StyleColorsDark(&style);
  style.WindowRounding = style.FrameRounding = style.PopupRounding = style.GrabRounding = 6;
  style.WindowBorderSize = style.FrameBorderSize = 0;
  style.WindowPadding = ImVec2(14, 12);
  style.FramePadding = ImVec2(10, 6);
  style.ItemSpacing = ImVec2(10, 8);
  const auto set = [&style](ImGuiCol which, ImU32 color) {
    style.Colors[which] = ImGui::ColorConvertU32ToFloat4(color);
  };
  set(ImGuiCol_Text, theme::text);
  set(ImGuiCol_TextDisabled, theme::dim);
  set(ImGuiCol_WindowBg, theme::panel);
  set(ImGuiCol_PopupBg, theme::panel);
  set(ImGuiCol_FrameBg, theme::raised);
  set(ImGuiCol_FrameBgHovered, theme::hovered);
  set(ImGuiCol_FrameBgActive, theme::hovered);
  set(ImGuiCol_Button, theme::raised);
  set(ImGuiCol_ButtonHovered, theme::hovered);
  set(ImGuiCol_ButtonActive, theme::line);
  set(ImGuiCol_SliderGrab, theme::blue);
  set(ImGuiCol_SliderGrabActive, theme::blue);
  set(ImGuiCol_CheckMark, theme::blue);
  set(ImGuiCol_PlotHistogram, theme::blue);
}

bool load_fonts(float scale) {
  ImFontAtlas& atlas = *ImGui::GetIO().Fonts;
  const float body_px = std::round(font_sizes[1] * scale);
  if (!atlas.Fonts.empty() && atlas.Fonts[1]->ConfigData->SizePixels == body_px) return false;
  const bool reload = !atlas.Fonts.empty();
  atlas.Clear();
  const std::string regular = regular_face(), bold = bold_face();
  for (std::size_t i = 0; i < font_sizes.size(); ++i) {
    const bool bold_letters = i >= 3;
    const std::string& face = bold_letters && !bold.empty() ? bold : regular;
    const float size_px = std::round(font_sizes[i] * scale);
    const ImWchar* letters = bold_letters ? few_letters.data() : many_letters.data();
    ImFont* font = face.empty() ? nullptr : atlas.AddFontFromFileTTF(face.c_str(), size_px, nullptr, letters);
    if (font == nullptr) {  // no such face here, or its file is broken
      ImFontConfig config;
      config.SizePixels = size_px;
      atlas.AddFontDefault(&config);
    }
  }
  atlas.Build();
  return reload;
}

WindowFonts window_fonts() {
  const ImVector<ImFont*>& fonts = ImGui::GetIO().Fonts->Fonts;
  return {fonts[0], fonts[1], fonts[2], fonts[3], fonts[4]};
}

}  // namespace gelslam::viewer::detail
