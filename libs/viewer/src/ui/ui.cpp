#include "gelslam/viewer/ui.hpp"

#include <imgui.h>

#include <algorithm>
#include <cctype>
#include <cfloat>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "gl/gl_objects.hpp"

namespace gelslam::viewer {
namespace {

constexpr const char* kEllipsis = "\u2026";
constexpr const char* kDialog = "##dialog";
constexpr ImGuiWindowFlags kBare = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav |
                                   ImGuiWindowFlags_NoScrollWithMouse;
/// Panels stay behind the dialog.
constexpr ImGuiWindowFlags kPanel =
    kBare | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoBringToFrontOnFocus;
constexpr Color kShade = theme::rgb(8, 10, 12, 150);
constexpr double kCardPadding = 18, kCardEdge = 9, kTagPadding = 8;

static_assert(theme::rgb(1, 2, 3, 4) == IM_COL32(1, 2, 3, 4), "colors are packed as ImGui packs them");

ImFont* font_of(Face face) { return ImGui::GetIO().Fonts->Fonts[static_cast<int>(face)]; }
ImVec2 top_left(const Box& box) { return {box.x, box.y}; }
ImVec2 bottom_right(const Box& box) { return {box.right(), box.bottom()}; }
bool within_letter(char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; }

ImVec2 size_of(Face face, std::string_view text, float wrap_width) {
  ImFont* font = font_of(face);
  return font->CalcTextSizeA(font->FontSize, FLT_MAX, wrap_width, text.data(), text.data() + text.size());
}

Box this_window() {
  const ImVec2 at = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
  return {at.x, at.y, size.x, size.y};
}

/// Marks outside of panels are drawn behind all panels.
ImDrawList* list_at(int panel_depth) {
  return panel_depth > 0 ? ImGui::GetWindowDrawList() : ImGui::GetBackgroundDrawList();
}

}  // namespace

Box Box::largest(float aspect) const {
  const float fitting = std::min(width, height / aspect), high = fitting * aspect;
  return {x + 0.5F * (width - fitting), y + 0.5F * (height - high), fitting, high};
}

Box Box::cut_top(float part) {
  y += part;
  height -= part;
  return {x, y - part, width, part};
}

Box Box::cut_bottom(float part) {
  height -= part;
  return {x, bottom(), width, part};
}

Box Box::cut_right(float part) {
  width -= part;
  return {right(), y, part, height};
}

/// Line breaks are set here because ImGui would also break at a decimal point. A single word that is too wide
/// is left to ImGui.
std::string wrapped(Face face, std::string_view text, float width) {
  std::string lines(text);
  std::size_t line = 0, blank = 0;
  for (std::size_t i = 1; width > 0 && i <= lines.size(); ++i) {
    const bool after_number = std::isdigit(static_cast<unsigned char>(lines[i - 1])) != 0;
    if (i < lines.size() && (lines[i] != ' ' || after_number)) continue;
    if (blank > line && size_of(face, std::string_view(lines).substr(line, i - line), 0).x > width) {
      lines[blank] = '\n';
      line = blank + 1;
    }
    blank = i;
  }
  return lines;
}

Color theme::with_alpha(Color color, double alpha) {
  const auto byte = static_cast<Color>(std::lround(255 * std::clamp(alpha, 0.0, 1.0)));
  return (color & ~IM_COL32_A_MASK) | (byte << IM_COL32_A_SHIFT);
}

Texture::~Texture() {
  if (id_ != 0) glDeleteTextures(1, &id_);
}

void Texture::set(const cv::Mat3b& bgr) {
  if (bgr.empty()) return;
  if (id_ == 0) glGenTextures(1, &id_);
  cv::Mat rgba;
  cv::cvtColor(bgr, rgba, cv::COLOR_BGR2RGBA);
  detail::fill_texture(id_, rgba.cols, rgba.rows, rgba.ptr());
  size_ = rgba.size();
}

Ui::Ui(float scale) : scale_(scale) {}

Ui::~Ui() {
  if (dialog_shown_ || !ImGui::IsPopupOpen(kDialog)) return;
  // ImGui can close a dialog only while it is being drawn.
  if (ImGui::BeginPopupModal(kDialog, nullptr, kBare)) {
    ImGui::CloseCurrentPopup();
    ImGui::EndPopup();
  }
}

Box Ui::window() const {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  return {0, 0, size.x, size.y};
}

void Ui::fill(const Box& box, Color color, double rounding) {
  list_at(panel_depth_)->AddRectFilled(top_left(box), bottom_right(box), color, px(rounding));
}

void Ui::frame(const Box& box, Color color, double rounding, double thickness) {
  list_at(panel_depth_)->AddRect(top_left(box), bottom_right(box), color, px(rounding), 0, px(thickness));
}

void Ui::disc(float x, float y, float radius, Color color) {
  list_at(panel_depth_)->AddCircleFilled({x, y}, radius, color, 32);
}

void Ui::ring(float x, float y, float radius, Color color, double thickness, const Box& clip) {
  ImDrawList* list = list_at(panel_depth_);
  list->PushClipRect(top_left(clip), bottom_right(clip), true);
  list->AddCircle({x, y}, radius, color, 96, px(thickness));
  list->PopClipRect();
}

void Ui::line(float x0, float y0, float x1, float y1, Color color, double thickness, const Box& clip) {
  ImDrawList* list = list_at(panel_depth_);
  list->PushClipRect(top_left(clip), bottom_right(clip), true);
  list->AddLine({x0, y0}, {x1, y1}, color, px(thickness));
  list->PopClipRect();
}

void Ui::image(const Texture& texture, const Box& box, double rounding) {
  list_at(panel_depth_)
      ->AddImageRounded(reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(texture.id())),  // NOLINT
                        top_left(box), bottom_right(box), {0, 0}, {1, 1}, IM_COL32_WHITE, px(rounding));
}

float Ui::width_of(Face face, std::string_view text) const { return size_of(face, text, 0).x; }
float Ui::height_of(Face face) const { return font_of(face)->FontSize; }
float Ui::height_of(Face face, std::string_view text, float wrap_width) const {
  return size_of(face, wrapped(face, text, wrap_width), wrap_width).y;
}

std::string Ui::fitted(Face face, std::string_view text, float width, Cut cut) const {
  if (width_of(face, text) <= width) return std::string(text);
  for (std::size_t kept = text.size(); kept-- > 0;) {
    const std::size_t at_end = cut == Cut::start ? kept : cut == Cut::middle ? kept / 2 : 0;
    std::string_view first = text.substr(0, kept - at_end), last = text.substr(text.size() - at_end);
    while (!first.empty() && within_letter(text[first.size()])) first.remove_suffix(1);
    while (!last.empty() && within_letter(last.front())) last.remove_prefix(1);
    const std::string shorter = std::string(first) + kEllipsis + std::string(last);
    if (width_of(face, shorter) <= width) return shorter;
  }
  return "";
}

void Ui::text_at(Face face, float x, float y, Color color, std::string_view text, float wrap_width) {
  ImFont* font = font_of(face);
  const ImVec2 corner(std::round(x), std::round(y));  // Whole pixels give sharp letters.
  const std::string shown = wrapped(face, text, wrap_width);
  const ImVec2 size = size_of(face, shown, wrap_width);
  if (panel_depth_ > 0 && !ImGui::IsRectVisible(corner, {corner.x + size.x, corner.y + size.y})) return;
  list_at(panel_depth_)
      ->AddText(font, font->FontSize, corner, color, shown.data(), shown.data() + shown.size(), wrap_width);
  texts_.push_back({std::string(text), {corner.x, corner.y, size.x, size.y}, color});
}

void Ui::text_right(Face face, float right, float y, Color color, std::string_view text) {
  text_at(face, right - width_of(face, text), y, color, text);
}

void Ui::text_centered(Face face, const Box& box, Color color, std::string_view text) {
  text_at(face, box.x + 0.5F * (box.width - width_of(face, text)),
          box.y + 0.5F * (box.height - height_of(face)), color, text);
}

void Ui::tag(Face face, float x, float y, Color ink, Color ground, std::string_view text, float anchor_x,
             float anchor_y) {
  const float width = width_of(face, text) + px(2 * kTagPadding), height = height_of(face) + px(kTagPadding);
  const Box box{x - anchor_x * width, y - anchor_y * height, width, height};
  fill(box, ground, 6);
  text_centered(face, box, ink, text);
}

Box Ui::card(float x, float y, float most_width, Color edge, const std::vector<Paragraph>& paragraphs,
             float anchor_x, float anchor_y, double least_width) {
  const float left = px(edge != 0 ? kCardEdge + kCardPadding : 0.7 * kCardPadding),
              right = px(edge != 0 ? kCardPadding : 0.7 * kCardPadding), padding = px(0.5 * kCardPadding);
  const float most = std::max(1.0F, most_width - left - right);
  float inner = std::min(px(least_width), most), height = 2 * padding;
  for (const Paragraph& p : paragraphs) inner = std::clamp(width_of(p.face, p.text) + 1, inner, most);
  for (const Paragraph& p : paragraphs) height += height_of(p.face, p.text, inner);
  const Box box{x - anchor_x * (inner + left + right), y - anchor_y * height, inner + left + right, height};
  fill(box, theme::kPanel, 10);
  if (edge != 0)
    fill({box.x, box.y, px(kCardEdge), box.height}, edge, 4);
  else
    frame(box, theme::kLine, 10);
  panels_.push_back(box);
  float top = box.y + padding;
  for (const Paragraph& p : paragraphs) {
    text_at(p.face, box.x + left, top, p.color, p.text, inner);
    top += height_of(p.face, p.text, inner);
  }
  return box;
}

void Ui::begin_panel(const char* id, const Box& box, double padding, double rounding, float anchor_x,
                     float anchor_y) {
  const float width = std::max(1.0F, box.width);
  const bool floats = box.height <= 0;
  ImGui::SetNextWindowPos(top_left(box), ImGuiCond_Always, {anchor_x, anchor_y});
  if (floats)
    ImGui::SetNextWindowSizeConstraints({width, 1}, {width, FLT_MAX});
  else
    ImGui::SetNextWindowSize({width, std::max(1.0F, box.height)});
  if (!floats) ImGui::SetNextWindowBgAlpha(1);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(px(padding), px(padding)));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, px(rounding));
  ImGui::Begin(id, nullptr, kPanel | (floats ? ImGuiWindowFlags_AlwaysAutoResize : 0));
  ImGui::PopStyleVar(2);
  needs_another_frame_ |= floats && ImGui::IsWindowAppearing();
  ++panel_depth_;
}

void Ui::end_panel() {
  panels_.push_back(this_window());
  ImGui::End();
  --panel_depth_;
}

void Ui::begin_child(const char* id, float height) { ImGui::BeginChild(id, {0, height}); }
void Ui::end_child() { ImGui::EndChild(); }

Box Ui::room() const {
  const ImVec2 at = ImGui::GetCursorScreenPos(), size = ImGui::GetContentRegionAvail();
  return {at.x, at.y, size.x, size.y};
}

void Ui::gap(double design_px) { ImGui::Dummy({0, px(design_px)}); }

void Ui::text(Face face, Color color, std::string_view text, Cut cut) {
  const Box place = room();
  const std::string shown = cut == Cut::none ? std::string(text) : fitted(face, text, place.width, cut);
  text_at(face, place.x, place.y, color, shown);
  ImGui::Dummy({width_of(face, shown), height_of(face)});
}

void Ui::paragraph(Face face, Color color, std::string_view text) {
  const Box place = room();
  const float wrap = std::max(1.0F, place.width);
  text_at(face, place.x, place.y, color, text, wrap);
  ImGui::Dummy({wrap, height_of(face, text, wrap)});
}

void Ui::row(Face face, std::string_view name, std::string_view value, Color value_color, Cut cut) {
  const Box place = room();
  const float left = place.width - width_of(face, value) - px(value.empty() ? 0 : 10);
  text_at(face, place.x, place.y, theme::kDim, fitted(face, name, left, cut));
  if (!value.empty()) text_right(face, place.right(), place.y, value_color, value);
  ImGui::Dummy({place.width, height_of(face)});
}

void Ui::bar(double share, Color color, double height) {
  const Box place = room();
  const auto part = [&](double s, Color c) {
    if (s > 0)
      fill({place.x, place.y, place.width * static_cast<float>(std::min(s, 1.0)), px(height)}, c, height / 2);
  };
  part(1, theme::kRaised);
  part(share, color);
  ImGui::Dummy({place.width, px(height)});
}

bool Ui::begin_table(const char* id, int columns, double column_gap, bool by_content) {
  ImGui::PushStyleVar(ImGuiStyleVar_CellPadding, ImVec2(0.5F * px(column_gap), 0));
  const bool shown =
      ImGui::BeginTable(id, columns,
                        ImGuiTableFlags_NoPadOuterX | (by_content ? ImGuiTableFlags_SizingStretchProp
                                                                  : ImGuiTableFlags_SizingStretchSame));
  ImGui::PopStyleVar();
  return shown;
}

void Ui::next_cell() { ImGui::TableNextColumn(); }
void Ui::end_table() { ImGui::EndTable(); }
void Ui::indent(double design_px) {
  design_px < 0 ? ImGui::Unindent(px(-design_px)) : ImGui::Indent(px(design_px));
}

std::optional<double> Ui::held_share(const char* id, const Box& box) {
  ImGui::SetCursorScreenPos(top_left(box));
  ImGui::InvisibleButton(id, {std::max(1.0F, box.width), std::max(1.0F, box.height)});
  if (!ImGui::IsItemActive()) return std::nullopt;
  return static_cast<double>((ImGui::GetIO().MousePos.x - box.x) / std::max(1.0F, box.width));
}

bool Ui::begin_dialog(float width) {
  dialog_shown_ = true;
  if (!ImGui::IsPopupOpen(kDialog)) ImGui::OpenPopup(kDialog);
  const Box whole = window();
  ImGui::SetNextWindowPos({0.5F * whole.width, 0.5F * whole.height}, ImGuiCond_Always, {0.5F, 0.5F});
  ImGui::SetNextWindowSizeConstraints({width, 1}, {width, FLT_MAX});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(px(kDialogPadding), px(kDialogPadding)));
  ImGui::SetNextWindowBgAlpha(0);  // The background is drawn after the shade.
  const bool has_room = ImGui::BeginPopupModal(kDialog, nullptr, kBare | ImGuiWindowFlags_AlwaysAutoResize);
  ImGui::PopStyleVar();
  if (!has_room) return false;
  ++panel_depth_;
  needs_another_frame_ = ImGui::IsWindowAppearing();
  const Box card = this_window();
  ImGui::GetWindowDrawList()->PushClipRectFullScreen();
  fill(whole, kShade);
  fill(card, theme::with_alpha(theme::kPanel, 1), 12);
  frame(card, theme::kLine, 12);
  ImGui::GetWindowDrawList()->PopClipRect();
  panels_.push_back(whole);
  return true;
}

void Ui::end_dialog() {
  ImGui::EndPopup();
  --panel_depth_;
}

}  // namespace gelslam::viewer
