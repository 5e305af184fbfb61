#include "ui/window_canvas.hpp"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstdint>

namespace gelslam::viewer::detail {
namespace {

constexpr const char* ellipsis = "\u2026";
constexpr ImGuiWindowFlags bare = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                  ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoSavedSettings |
                                  ImGuiWindowFlags_NoNav | ImGuiWindowFlags_NoScrollWithMouse;

void open_layer(const char* name) {
  ImGui::SetNextWindowPos({0, 0});
  ImGui::SetNextWindowSize(ImGui::GetIO().DisplaySize);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0, 0));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, ImVec2(1, 1));
  ImGui::Begin(name, nullptr, bare);
  ImGui::PopStyleVar(2);
}

}  // namespace

Canvas::Canvas(float scale) : scale_(scale), fonts_(window_fonts()) {
  open_layer("##window");
  list_ = ImGui::GetWindowDrawList();
}

Canvas::~Canvas() { ImGui::End(); }

void Canvas::cover(ImU32 color) {
  ImGui::End();
  open_layer("##cover");
  ImGui::SetWindowFocus();
  list_ = ImGui::GetWindowDrawList();
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  panel({0, 0, size.x, size.y}, color, 0);
}

void Canvas::fill(const Box& box, ImU32 color, double rounding) {
  list_->AddRectFilled(box.top_left(), box.bottom_right(), color, px(rounding));
}

void Canvas::frame(const Box& box, ImU32 color, double rounding, double thickness) {
  list_->AddRect(box.top_left(), box.bottom_right(), color, px(rounding), 0, px(thickness));
}

void Canvas::panel(const Box& box, ImU32 color, double rounding) {
  fill(box, color, rounding);
  panels_.push_back(box);
}

void Canvas::disc(float x, float y, float radius, ImU32 color) {
  list_->AddCircleFilled({x, y}, radius, color, 32);
}

void Canvas::ring(float x, float y, float radius, ImU32 color, double thickness, const Box& clip) {
  list_->PushClipRect(clip.top_left(), clip.bottom_right(), true);
  list_->AddCircle({x, y}, radius, color, 96, px(thickness));
  list_->PopClipRect();
}

void Canvas::image(unsigned texture, const Box& box, double rounding) {
  list_->AddImageRounded(reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(texture)), box.top_left(),
                         box.bottom_right(), {0, 0}, {1, 1}, IM_COL32_WHITE, px(rounding));
}

float Canvas::width_of(ImFont* font, std::string_view text) const {
  return font->CalcTextSizeA(font->FontSize, FLT_MAX, 0, text.data(), text.data() + text.size()).x;
}

float Canvas::height_of(ImFont* font, std::string_view text, float wrap_width) const {
  return font->CalcTextSizeA(font->FontSize, FLT_MAX, wrap_width, text.data(), text.data() + text.size()).y;
}

void Canvas::text(ImFont* font, float x, float y, ImU32 color, std::string_view text) {
  text_wrapped(font, x, y, 0, color, text);
}

void Canvas::text_right(ImFont* font, float right, float y, ImU32 color, std::string_view words) {
  text(font, right - width_of(font, words), y, color, words);
}

void Canvas::text_centered(ImFont* font, const Box& box, ImU32 color, std::string_view words) {
  text(font, box.x + 0.5F * (box.width - width_of(font, words)), box.y + 0.5F * (box.height - font->FontSize),
       color, words);
}

float Canvas::text_wrapped(ImFont* font, float x, float y, float wrap_width, ImU32 color,
                           std::string_view text) {
  const char* end = text.data() + text.size();
  const ImVec2 corner(std::round(x), std::round(y));  // whole pixels: sharp letters
  const ImVec2 size = font->CalcTextSizeA(font->FontSize, FLT_MAX, wrap_width, text.data(), end);
  list_->AddText(font, font->FontSize, corner, color, text.data(), end, wrap_width);
  record({corner.x, corner.y, size.x, size.y}, color, text);
  return size.y;
}

std::string Canvas::fitted(ImFont* font, std::string_view text, float width, Cut cut) const {
  if (width_of(font, text) <= width) return std::string(text);
  const auto within_letter = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; };
  while (!text.empty()) {
    if (cut == Cut::start) {
      do text.remove_prefix(1);
      while (!text.empty() && within_letter(text.front()));
    } else {
      while (within_letter(text.back()) && text.size() > 1) text.remove_suffix(1);
      text.remove_suffix(1);
    }
    const std::string shortened =
        cut == Cut::start ? ellipsis + std::string(text) : std::string(text) + ellipsis;
    if (width_of(font, shortened) <= width) return shortened;
  }
  return "";
}

bool Canvas::button(const Box& box, std::string_view label, std::string_view hint, ImU32 face, ImU32 ink) {
  ImGui::SetCursorScreenPos(box.top_left());
  ImGui::PushID(label.data(), label.data() + label.size());
  const bool clicked =
      ImGui::InvisibleButton("##button", {std::max(1.0F, box.width), std::max(1.0F, box.height)});
  const bool pressed = ImGui::IsItemActive(), hovered = ImGui::IsItemHovered();
  ImGui::PopID();
  panel(box, pressed ? theme::line : hovered ? theme::hovered : face, 7);
  const float label_height = fonts_.body->FontSize, hint_height = hint.empty() ? 0 : fonts_.small->FontSize;
  const float top = box.y + 0.5F * (box.height - label_height - hint_height);
  text_centered(fonts_.body, {box.x, top, box.width, label_height}, ink, label);
  if (!hint.empty())
    text_centered(fonts_.small, {box.x, top + label_height, box.width, hint_height}, theme::dim, hint);
  return clicked;
}

void Canvas::record(const Box& box, ImU32 color, std::string_view text) {
  texts_.push_back({std::string(text), box, color});
}

}  // namespace gelslam::viewer::detail
