#include <algorithm>
#include <cmath>
#include <string_view>

#include "ui/panels.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double margin = 18, padding = 18, edge = 9;

/// Height of a box with a colored edge and sentences of one size.
float draw_note(Canvas& canvas, float x, float y, float width, ImU32 color, ImFont* font,
                std::string_view words) {
  const float inner = width - canvas.px(2 * padding + edge);
  const float height = canvas.height_of(font, words, inner) + canvas.px(1.2 * padding);
  canvas.panel({x, y, width, height}, theme::panel);
  canvas.fill({x, y, canvas.px(edge), height}, color, 4);
  canvas.text_wrapped(font, x + canvas.px(edge + padding), y + canvas.px(0.6 * padding), inner, theme::text,
                      words);
  return height;
}

/// A bar that says "something is going on", without claiming to know how long.
void draw_activity(Canvas& canvas, const Box& box, double time_s) {
  canvas.fill(box, theme::raised, 3);
  const double at = 0.5 - 0.5 * std::cos(1.8 * time_s);
  const float width = 0.25F * box.width;
  canvas.fill({box.x + static_cast<float>(at) * (box.width - width), box.y, width, box.height}, theme::blue,
              3);
}

/// The state in large letters, with what to do; returns the height.
float draw_state(Canvas& canvas, float x, float y, float most, const StateWords& words, double time_s) {
  const WindowFonts& fonts = canvas.fonts();
  const ImU32 color = theme::of_state(words.state);
  const float around = canvas.px(2 * padding + edge), inner_most = most - around;
  ImFont* font =
      canvas.width_of(fonts.headline, words.headline) <= inner_most ? fonts.headline : fonts.figure;
  const float wanted =
      std::max(canvas.width_of(font, words.headline), canvas.width_of(fonts.title, words.advice) + 1);
  const float inner = std::clamp(wanted, std::min(canvas.px(240), inner_most), inner_most);
  const float advice_height =
      words.advice.empty() ? 0 : canvas.height_of(fonts.title, words.advice, inner) + canvas.px(4);
  const bool busy = words.state == LiveState::finishing || words.state == LiveState::background;
  const float height = font->FontSize + advice_height + canvas.px(padding + (busy ? 16 : 0));
  canvas.panel({x, y, inner + around, height}, theme::panel);
  canvas.fill({x, y, canvas.px(edge), height}, color, 4);
  const float left = x + canvas.px(edge + padding);
  float top = y + canvas.px(0.4 * padding);
  canvas.text(font, left, top, color, words.headline);
  top += font->FontSize;
  if (!words.advice.empty()) canvas.text_wrapped(fonts.title, left, top, inner, theme::text, words.advice);
  if (busy) draw_activity(canvas, {left, top + advice_height + canvas.px(8), inner, canvas.px(5)}, time_s);
  return height;
}

}  // namespace

void draw_banner(Canvas& canvas, const Box& view, const LiveFrame& frame, bool names_folder) {
  const float x = view.x + canvas.px(margin), gap = canvas.px(10);
  const float most = std::min(view.width - canvas.px(2 * margin), canvas.px(620));
  ImFont* font = canvas.fonts().body;
  float y = view.y + canvas.px(margin);
  y += draw_state(canvas, x, y, most, frame.words, frame.time_s) + gap;
  if (!frame.status.warning.empty())
    y += draw_note(canvas, x, y, most, theme::amber, font, frame.status.warning) + gap;
  if (names_folder && frame.words.state == LiveState::finished && !frame.output_folder.empty())
    draw_note(canvas, x, y, most, theme::green, font, "Saved in " + frame.output_folder);
}

}  // namespace gelslam::viewer::detail
