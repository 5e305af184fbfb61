#include <algorithm>
#include <cmath>

#include "panels.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double margin = 18, padding = 18, edge = 9;

/// Height of a box with a coloured edge and sentences of one size.
float draw_note(Canvas& canvas, float x, float y, float width, ImU32 colour, ImFont* font,
                std::string_view words) {
  const float inner = width - canvas.px(2 * padding + edge);
  const float height = canvas.height_of(font, words, inner) + canvas.px(1.2 * padding);
  canvas.panel({x, y, width, height}, theme::panel);
  canvas.fill({x, y, canvas.px(edge), height}, colour, 4);
  canvas.text_wrapped(font, x + canvas.px(edge + padding), y + canvas.px(0.6 * padding), inner, theme::text,
                      words);
  return height;
}

std::string results_sentence(const LiveFrame& frame) {
  return std::to_string(frame.status.keyframes) + " keyframes, " + std::to_string(frame.status.loops) +
         " loops, " + text_of_count(static_cast<std::int64_t>(frame.triangles)) + " triangles, " +
         text_of_duration(frame.status.age_s) + " of scanning";
}

/// Where everything is, once it is finished.
float draw_results(Canvas& canvas, float x, float y, float width, float room, const LiveFrame& frame) {
  const WindowFonts& fonts = canvas.fonts();
  const float inner = width - canvas.px(2 * padding), row = fonts.body->FontSize + canvas.px(5);
  const float head = fonts.body->FontSize + fonts.small->FontSize + canvas.px(26);
  const auto rows =
      std::min(frame.results.size(), static_cast<std::size_t>(std::max(0.0F, (room - head) / row - 1)));
  const float height = head + row * static_cast<float>(rows) + canvas.px(padding);
  canvas.panel({x, y, width, height}, theme::panel);
  const float left = x + canvas.px(padding);
  float top = y + canvas.px(0.8 * padding);
  canvas.text(fonts.body, left, top, theme::text, canvas.fitted(fonts.body, frame.output_folder, inner));
  top += fonts.body->FontSize + canvas.px(4);
  canvas.text(fonts.small, left, top, theme::dim, results_sentence(frame));
  top += fonts.small->FontSize + canvas.px(10);
  for (std::size_t i = 0; i < rows; ++i, top += row) {
    const std::string size = text_of_bytes(frame.results[i].bytes);
    const float room_px = inner - canvas.width_of(fonts.body, size) - canvas.px(12);
    canvas.text(fonts.body, left, top, theme::text,
                canvas.fitted(fonts.body, frame.results[i].name, room_px));
    canvas.text_right(fonts.body, left + inner, top, theme::dim, size);
  }
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

}  // namespace

void draw_banner(Canvas& canvas, const Box& view, const LiveFrame& frame) {
  const WindowFonts& fonts = canvas.fonts();
  const StateWords& words = frame.words;
  const ImU32 colour = theme::of_state(words.state);
  const float x = view.x + canvas.px(margin), most = view.width - canvas.px(2 * margin);
  const float around = canvas.px(2 * padding + edge), inner_most = std::min(most, canvas.px(620)) - around;
  ImFont* font =
      canvas.width_of(fonts.headline, words.headline) <= inner_most ? fonts.headline : fonts.figure;
  const float inner =
      std::clamp(std::max(canvas.width_of(font, words.headline), canvas.width_of(fonts.title, words.advice)),
                 std::min(canvas.px(240), inner_most), inner_most);
  const float advice_height =
      words.advice.empty() ? 0 : canvas.height_of(fonts.title, words.advice, inner) + canvas.px(4);
  const bool busy = words.state == LiveState::finishing || words.state == LiveState::background;
  const float height = font->FontSize + advice_height + canvas.px(padding + (busy ? 16 : 0));
  float y = view.y + canvas.px(margin);
  canvas.panel({x, y, inner + around, height}, theme::panel);
  canvas.fill({x, y, canvas.px(edge), height}, colour, 4);
  const float left = x + canvas.px(edge + padding);
  float top = y + canvas.px(0.4 * padding);
  canvas.text(font, left, top, colour, words.headline);
  top += font->FontSize;
  if (!words.advice.empty()) canvas.text_wrapped(fonts.title, left, top, inner, theme::text, words.advice);
  if (busy)
    draw_activity(canvas, {left, top + advice_height + canvas.px(8), inner, canvas.px(5)}, frame.time_s);
  y += height + canvas.px(10);

  const float note_width = std::min(most, canvas.px(620));
  if (!frame.status.warning.empty())
    y += draw_note(canvas, x, y, note_width, theme::amber, fonts.body, frame.status.warning) + canvas.px(10);
  if (frame.apart && words.state == LiveState::tracking)
    y += draw_note(canvas, x, y, note_width, theme::blue, fonts.body,
                   "A new piece, not yet joined to the map: roll to a place you have seen.") +
         canvas.px(10);
  const float room = view.bottom() - y - canvas.px(margin);
  if (words.state == LiveState::finished && room > canvas.px(90))
    draw_results(canvas, x, y, std::min(most, canvas.px(460)), room, frame);
}

}  // namespace gelslam::viewer::detail
