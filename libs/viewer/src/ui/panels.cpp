#include "ui/panels.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double side_width = 298, bar_height = 62;
/// Below this the view needs the whole window.
constexpr double smallest_view_width = 480, smallest_side_height = 420, smallest_bar_width = 300;

}  // namespace

PanelLayout lay_out(const Canvas& canvas, float width_px, float height_px, bool with_panels) {
  PanelLayout layout;
  layout.view = {0, 0, width_px, height_px};
  if (!with_panels) return layout;
  if (width_px >= canvas.px(smallest_bar_width) && height_px >= canvas.px(3 * bar_height)) {
    const float height = canvas.px(bar_height);
    layout.bar = {0, height_px - height, width_px, height};
    layout.view.height -= height;
  }
  if (width_px >= canvas.px(side_width + smallest_view_width) &&
      layout.view.height >= canvas.px(smallest_side_height)) {
    const float width = canvas.px(side_width);
    layout.side = {width_px - width, 0, width, layout.view.height};
    layout.view.width -= width;
  }
  return layout;
}

void draw_panels(Canvas& canvas, const PanelLayout& layout, const LiveFrame& frame, LiveControls& controls) {
  if (controls.shows_panels()) {
    draw_view_marks(canvas, layout.view, frame);
    draw_banner(canvas, layout.view, frame, layout.side.width <= 0);
  }
  if (layout.side.width > 0) draw_side(canvas, layout.side, frame);
  if (layout.bar.width > 0) draw_bar(canvas, layout.bar, frame, controls);
  draw_toasts(canvas, layout.view, controls);
  if (controls.dialog() != Dialog::none) draw_dialog(canvas, frame, controls);
}

}  // namespace gelslam::viewer::detail
