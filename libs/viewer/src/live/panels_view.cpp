#include <array>
#include <cmath>
#include <cstdio>

#include "ui/panels.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double margin = 18;

std::string number_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", value);
  return text.data();
}

/// The longest of 1, 2, 5, 10, ... mm that is not wider than the room.
double round_length_mm(double room_mm) {
  const double decade = std::pow(10.0, std::floor(std::log10(room_mm)));
  for (const double digit : {5.0, 2.0})
    if (digit * decade <= room_mm) return digit * decade;
  return decade;
}

void draw_scale_bar(Canvas& canvas, const Box& view, double mm_per_px) {
  if (!(mm_per_px > 0) || !std::isfinite(mm_per_px)) return;
  const double length_mm = round_length_mm(mm_per_px * canvas.px(140));
  const auto width = static_cast<float>(length_mm / mm_per_px);
  const float x = view.x + canvas.px(margin + 4), y = view.bottom() - canvas.px(margin + 6),
              tick = canvas.px(9);
  const ImU32 color = theme::gray;
  canvas.fill({x, y, width, canvas.px(2)}, color);
  canvas.fill({x, y - tick + canvas.px(2), canvas.px(2), tick}, color);
  canvas.fill({x + width - canvas.px(2), y - tick + canvas.px(2), canvas.px(2), tick}, color);
  canvas.text(canvas.fonts().body, x + canvas.px(2), y - tick - canvas.fonts().body->FontSize, color,
              number_text(length_mm) + " mm");
}

void draw_legend(Canvas& canvas, const Box& view, const ColorLegend& legend) {
  const WindowFonts& fonts = canvas.fonts();
  const float width = canvas.px(16), height = std::min(canvas.px(220), 0.45F * view.height);
  const Box bar{view.right() - canvas.px(margin) - width, view.bottom() - canvas.px(margin + 14) - height,
                width, height};
  const auto steps = legend.colors_rgb.size();
  for (std::size_t i = 0; i < steps; ++i) {
    const auto& rgb = legend.colors_rgb[i];
    const float share = 1.0F / static_cast<float>(steps), from_below = static_cast<float>(i + 1) * share;
    canvas.fill({bar.x, bar.y + (1 - from_below) * bar.height, bar.width, share * bar.height + 1},
                IM_COL32(rgb[0], rgb[1], rgb[2], 255));
  }
  const std::string unit = legend.unit.empty() ? "" : " " + legend.unit;
  const float right = bar.x - canvas.px(8);
  canvas.text_right(fonts.small, right, bar.y, theme::text, number_text(legend.max) + unit);
  canvas.text_right(fonts.small, right, bar.bottom() - fonts.small->FontSize, theme::text,
                    number_text(legend.min) + unit);
  canvas.text_right(fonts.body, bar.right(), bar.y - fonts.body->FontSize - canvas.px(6), theme::text,
                    legend.title);
}

}  // namespace

void draw_view_marks(Canvas& canvas, const Box& view, const LiveFrame& frame) {
  draw_scale_bar(canvas, view, frame.mm_per_px);
  if (frame.legend && view.height > canvas.px(380)) draw_legend(canvas, view, *frame.legend);
}

void draw_toasts(Canvas& canvas, const Box& view, const LiveControls& controls) {
  ImFont* font = canvas.fonts().body;
  const float most = view.width - canvas.px(4 * margin), padding = canvas.px(12);
  float bottom = view.bottom() - canvas.px(margin);
  for (auto toast = controls.toasts().rbegin(); toast != controls.toasts().rend(); ++toast) {
    const float inner = std::min(canvas.width_of(font, toast->text), most);
    const float height = canvas.height_of(font, toast->text, inner + 1) + 1.5F * padding;
    const Box box{view.x + 0.5F * (view.width - inner) - padding, bottom - height, inner + 2 * padding,
                  height};
    canvas.fill(box, theme::panel, 8);
    canvas.frame(box, toast->trouble ? theme::red : theme::line, 8, toast->trouble ? 2 : 1);
    canvas.text_wrapped(font, box.x + padding, box.y + 0.75F * padding, inner + 1, theme::text, toast->text);
    bottom -= height + canvas.px(6);
    if (bottom < view.y + canvas.px(60)) return;
  }
}

}  // namespace gelslam::viewer::detail
