#include "ui/window_cards.hpp"

#include <algorithm>

namespace gelslam::viewer::detail {

void draw_note(Canvas& canvas, const Box& view, const std::string& text) {
  if (text.empty()) return;
  ImFont* font = canvas.fonts().body;
  // One more than it needs: a text that just fits must not be broken.
  const float inner = std::max(1.0F, std::min(canvas.width_of(font, text) + 1, view.width - canvas.px(84)));
  const float width = inner + canvas.px(24), height = canvas.height_of(font, text, inner) + canvas.px(18);
  const Box box{view.x + 0.5F * (view.width - width), view.bottom() - height - canvas.px(18), width, height};
  canvas.fill(box, theme::panel, 8);
  canvas.frame(box, theme::line, 8);
  canvas.text_wrapped(font, box.x + canvas.px(12), box.y + canvas.px(9), inner, theme::text, text);
}

void draw_help_card(Canvas& canvas, const Box& view, const std::vector<HelpLine>& lines) {
  ImFont* font = canvas.fonts().body;
  const float row = font->FontSize + canvas.px(6), width = canvas.px(420);
  const float height = row * static_cast<float>(lines.size()) + canvas.px(40);
  const Box card{view.x + 0.5F * (view.width - width), std::max(0.0F, view.y + 0.5F * (view.height - height)),
                 width, height};
  canvas.panel(card, theme::panel, 12);
  canvas.frame(card, theme::line, 12);
  float y = card.y + canvas.px(20);
  for (const auto& [key, what] : lines) {
    canvas.text_right(font, card.x + canvas.px(125), y, theme::blue, key);
    canvas.text(font, card.x + canvas.px(145), y, theme::text, what);
    y += row;
  }
}

}  // namespace gelslam::viewer::detail
