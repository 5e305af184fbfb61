#pragma once

#include <string>
#include <vector>

#include "ui/window_canvas.hpp"

namespace gelslam::viewer::detail {

struct HelpLine {
  std::string key, what;
};

/// A line near the lower edge of the view that says what was done; nothing for an empty one.
void draw_note(Canvas& canvas, const Box& view, const std::string& text);

/// Keys and what they do, in the middle of the view.
void draw_help_card(Canvas& canvas, const Box& view, const std::vector<HelpLine>& lines);

}  // namespace gelslam::viewer::detail
