#pragma once

#include <optional>
#include <string>
#include <vector>

#include "browse/view_controls.hpp"
#include "gelslam/viewer/view_stage.hpp"
#include "ui/window_canvas.hpp"

namespace gelslam::viewer::detail {

/// Where the parts of the window of `gelslam view` lie; parts for which there is no room are empty.
struct ViewLayout {
  Box view, slider, bar;
  Box track;  ///< of the slider: where a press sets the time
};
ViewLayout lay_out_view(const Canvas& canvas, float width_px, float height_px, const ViewControls& controls);

/// What the panels say, gathered once per frame.
struct ViewFrame {
  std::vector<Box> parts;           ///< of the view: one, or two beside each other
  std::vector<std::string> titles;  ///< as many
  std::optional<ColorLegend> legend;
  double mm_per_px = 0;
  bool works = false;   ///< the surface of the time is still being fused
  std::string message;  ///< what was done, or empty
};

/// All of it, over the view that was drawn before. Buttons go to `controls`.
void draw_view_panels(Canvas& canvas, const ViewLayout& layout, const ViewFrame& frame,
                      const RunHistory* history, ViewControls& controls);

}  // namespace gelslam::viewer::detail
