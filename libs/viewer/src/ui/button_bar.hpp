#pragma once

#include <optional>
#include <string>
#include <vector>

#include "ui/window_canvas.hpp"

namespace gelslam::viewer::detail {

struct BarItem {
  std::string label, key_name;
  int group = 0;     ///< a gap goes between groups
  int priority = 0;  ///< the highest numbers go first where there is no room; 0 stays
  ImU32 ink = theme::text;
};

/// A row of buttons at the window's lower edge; which was clicked. Those that do not fit are left out: their
/// keys work all the same.
std::optional<std::size_t> draw_button_bar(Canvas& canvas, const Box& bar, const std::vector<BarItem>& items);

}  // namespace gelslam::viewer::detail
