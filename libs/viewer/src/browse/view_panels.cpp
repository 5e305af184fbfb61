#include "browse/view_panels.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "ui/button_bar.hpp"
#include "ui/panels.hpp"
#include "ui/window_cards.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double kBarHeight = 62, kSliderHeight = 46;

std::string seconds_text(double time_s) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f s", time_s);
  return text.data();
}

struct ViewButton {
  ViewAction action;
  const char* label;
  int group, priority;  ///< see BarItem
  bool lit;
};

std::vector<ViewButton> buttons_of(const ViewControls& controls) {
  using enum ViewAction;
  const SceneStyle& style = controls.style();
  std::vector<ViewButton> buttons;
  if (controls.has_time()) {
    buttons.push_back({play, controls.plays() ? "Rest" : "Play", 0, 1, controls.plays()});
    buttons.push_back({trajectory, "Trajectory", 1, 5, style.trajectory});
    buttons.push_back({pose_graph, "Graph", 1, 5, style.edges});
  }
  buttons.push_back({shading_lit, "Clay", 2, 4, style.shading == SceneShading::lit});
  buttons.push_back({shading_matcap, "Polish", 2, 4, style.shading == SceneShading::matcap});
  buttons.push_back({shading_curvature, "Curvature", 2, 4, style.shading == SceneShading::curvature});
  buttons.push_back({next_color, "Colors", 3, 2, style.color != SceneColor::plain});
  buttons.push_back({light_theme, "Light", 3, 7, style.light_theme});
  buttons.push_back({show_all, "Show all", 4, 3, false});
  buttons.push_back({screenshot, "Picture", 4, 6, false});
  buttons.push_back({help, "Help", 5, 2, controls.shows_help()});
  buttons.push_back({close, "Close", 5, 0, false});
  return buttons;
}

void draw_buttons(Canvas& canvas, const Box& bar, ViewControls& controls) {
  const std::vector<ViewButton> buttons = buttons_of(controls);
  std::vector<BarItem> items;
  for (const ViewButton& button : buttons)
    items.push_back({button.label, key_name_of(view_keys(), button.action), button.group, button.priority,
                     button.lit ? theme::blue : theme::text});
  if (const auto clicked = draw_button_bar(canvas, bar, items)) controls.perform(buttons[*clicked].action);
}

void draw_slider(Canvas& canvas, const ViewLayout& layout, const RunHistory& history,
                 const ViewControls& controls) {
  canvas.panel(layout.slider, theme::with_alpha(theme::panel, 1), 0);
  const Box& track = layout.track;
  const float middle = track.y + 0.5F * track.height,
              at = track.x + static_cast<float>(controls.share()) * track.width;
  const double length_s = std::max(history.end_s() - history.start_s(), 1e-9);
  for (const RunHistory::KeyframeAt& keyframe : history.keyframes) {
    const auto share = static_cast<float>((keyframe.time_s - history.start_s()) / length_s);
    canvas.fill({track.x + share * track.width, middle - canvas.px(7), canvas.px(1), canvas.px(14)},
                theme::line);
  }
  canvas.fill({track.x, middle - canvas.px(2), track.width, canvas.px(4)}, theme::raised, 2);
  canvas.fill({track.x, middle - canvas.px(2), at - track.x, canvas.px(4)}, theme::blue, 2);
  canvas.disc(at, middle, canvas.px(8), theme::text);
  const std::string time =
      controls.time_s() ? seconds_text(*controls.time_s() - history.start_s()) : "as saved";
  const float y = middle - 0.5F * canvas.fonts().body->FontSize;
  canvas.text_right(canvas.fonts().body, layout.slider.right() - canvas.px(16), y, theme::text, time);
}

void draw_titles(Canvas& canvas, const ViewFrame& frame, bool light_theme) {
  const ImU32 ink = light_theme ? theme::panel : theme::text;
  for (std::size_t i = 0; i < frame.parts.size(); ++i) {
    const Box& part = frame.parts[i];
    const float x = part.x + canvas.px(18), y = part.y + canvas.px(14);
    canvas.text(canvas.fonts().title, x, y, ink,
                canvas.fitted(canvas.fonts().title, frame.titles[i], part.width - canvas.px(36)));
    if (i > 0) canvas.fill({part.x, part.y, canvas.px(1), part.height}, theme::line);
  }
  if (frame.works) {
    canvas.text(canvas.fonts().body, frame.parts[0].x + canvas.px(18), frame.parts[0].y + canvas.px(46),
                theme::amber, "Fusing the surface of this time");
  }
}

std::vector<HelpLine> help_lines() {
  std::vector<HelpLine> lines;
  for (const auto& key : view_keys()) lines.push_back({key.key_name, key.what});
  lines.insert(lines.end(), {{"Left drag", "Turn"},
                             {"Right drag", "Move"},
                             {"Wheel", "Nearer, further"},
                             {"Double click", "Turn about this place"}});
  return lines;
}

}  // namespace

ViewLayout lay_out_view(const Canvas& canvas, float width_px, float height_px, const ViewControls& controls) {
  ViewLayout layout;
  layout.view = {0, 0, width_px, height_px};
  if (!controls.shows_panels() || height_px < canvas.px(4 * kBarHeight)) return layout;
  layout.bar = {0, height_px - canvas.px(kBarHeight), width_px, canvas.px(kBarHeight)};
  layout.view.height -= layout.bar.height;
  if (!controls.has_time()) return layout;
  layout.slider = {0, layout.bar.y - canvas.px(kSliderHeight), width_px, canvas.px(kSliderHeight)};
  layout.view.height -= layout.slider.height;
  layout.track = {canvas.px(22), layout.slider.y, width_px - canvas.px(22 + 110), layout.slider.height};
  return layout;
}

void draw_view_panels(Canvas& canvas, const ViewLayout& layout, const ViewFrame& frame,
                      const RunHistory* history, ViewControls& controls) {
  if (controls.shows_panels()) {
    draw_titles(canvas, frame, controls.style().light_theme);
    LiveFrame marks;
    marks.legend = frame.legend;
    marks.mm_per_px = frame.mm_per_px;
    draw_view_marks(canvas, frame.parts.front(), marks);
  }
  if (layout.slider.width > 0 && history != nullptr) draw_slider(canvas, layout, *history, controls);
  if (layout.bar.width > 0) draw_buttons(canvas, layout.bar, controls);
  draw_note(canvas, layout.view, frame.message);
  if (controls.shows_help()) draw_help_card(canvas, layout.view, help_lines());
}

}  // namespace gelslam::viewer::detail
