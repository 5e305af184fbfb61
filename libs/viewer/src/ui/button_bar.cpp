#include "ui/button_bar.hpp"

#include <algorithm>
#include <numeric>

namespace gelslam::viewer::detail {
namespace {

constexpr double margin = 9, gap = 6, group_gap = 20, padding = 11;

using Shown = std::vector<std::size_t>;  // indices of items

float width_of(const Canvas& canvas, const BarItem& item) {
  return std::max(canvas.width_of(canvas.fonts().body, item.label) + canvas.px(2 * padding),
                  canvas.width_of(canvas.fonts().small, item.key_name) + canvas.px(padding));
}

float gap_before(const Canvas& canvas, const std::vector<BarItem>& items, const Shown& shown, std::size_t i) {
  if (i == 0) return 0;
  return canvas.px(items[shown[i]].group == items[shown[i - 1]].group ? gap : group_gap);
}

float total_width(const Canvas& canvas, const std::vector<BarItem>& items, const Shown& shown) {
  float width = canvas.px(2 * margin);
  for (std::size_t i = 0; i < shown.size(); ++i)
    width += gap_before(canvas, items, shown, i) + width_of(canvas, items[shown[i]]);
  return width;
}

Shown those_that_fit(const Canvas& canvas, const std::vector<BarItem>& items, float room) {
  Shown shown(items.size());
  std::iota(shown.begin(), shown.end(), std::size_t{0});
  int worst = 0;
  for (const BarItem& item : items) worst = std::max(worst, item.priority);
  for (; worst > 0 && total_width(canvas, items, shown) > room; --worst)
    std::erase_if(shown, [&](std::size_t k) { return items[k].priority == worst; });
  return shown;
}

}  // namespace

std::optional<std::size_t> draw_button_bar(Canvas& canvas, const Box& bar,
                                           const std::vector<BarItem>& items) {
  canvas.panel(bar, theme::with_alpha(theme::panel, 1), 0);
  canvas.fill({bar.x, bar.y, bar.width, canvas.px(1)}, theme::line);
  const Shown shown = those_that_fit(canvas, items, bar.width);
  std::optional<std::size_t> clicked;
  float x = bar.x + canvas.px(margin);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const BarItem& item = items[shown[i]];
    x += gap_before(canvas, items, shown, i);
    const Box box{x, bar.y + canvas.px(margin), width_of(canvas, item), bar.height - canvas.px(2 * margin)};
    if (canvas.button(box, item.label, item.key_name, theme::raised, item.ink)) clicked = shown[i];
    x = box.right();
  }
  return clicked;
}

}  // namespace gelslam::viewer::detail
