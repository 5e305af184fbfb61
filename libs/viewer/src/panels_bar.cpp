#include <vector>

#include "panels.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double margin = 9, gap = 6, button_padding = 11, group_gap = 20;

struct BarButton {
  WindowAction action;
  std::string label;
  int group;     ///< a gap goes between groups
  int priority;  ///< the highest numbers go first where there is no room
  bool lit = false;
};

std::vector<BarButton> buttons_of(const LiveFrame& frame, const LiveControls& controls) {
  using enum WindowAction;
  const SceneStyle& style = controls.style();
  std::vector<BarButton> buttons;
  const LivePhase phase = frame.status.phase;
  const bool over = phase == LivePhase::finishing || phase == LivePhase::finished;
  if (!over) {
    buttons.push_back({pause, phase == LivePhase::paused ? "Go on" : "Pause", 0, 1});
    buttons.push_back({undo_trial, "Undo", 0, 4});
    buttons.push_back({new_scan, "New scan", 0, 5});
    buttons.push_back({save, "Save", 0, 3});
  }
  buttons.push_back({stop, over ? "Close" : "Stop", 0, 0});
  buttons.push_back({screenshot, "Picture", 1, 6});
  buttons.push_back({export_mesh, "Export", 1, 5});
  if (!over) buttons.push_back({follow, "Follow", 2, 7, controls.follows()});
  buttons.push_back({reset_view, "Show all", 2, 6});
  buttons.push_back({trajectory, "Trajectory", 2, 8, style.trajectory});
  buttons.push_back({pose_graph, "Graph", 2, 8, style.edges});
  buttons.push_back({next_colour, "Colours", 2, 9, style.colour != SceneColour::plain});
  buttons.push_back({shading_lit, "Clay", 3, 10, style.shading == SceneShading::lit});
  buttons.push_back({shading_matcap, "Polish", 3, 10, style.shading == SceneShading::matcap});
  buttons.push_back({shading_relief, "Relief", 3, 10, style.shading == SceneShading::relief});
  buttons.push_back({help, "Help", 4, 2});
  return buttons;
}

float width_of(const Canvas& canvas, const BarButton& button) {
  return canvas.width_of(canvas.fonts().body, button.label) + canvas.px(2 * button_padding);
}

float total_width(const Canvas& canvas, const std::vector<BarButton>& buttons) {
  float width = canvas.px(2 * margin);
  for (std::size_t i = 0; i < buttons.size(); ++i) {
    width += width_of(canvas, buttons[i]);
    if (i > 0) width += canvas.px(buttons[i].group == buttons[i - 1].group ? gap : group_gap);
  }
  return width;
}

/// Leaves out the least important ones until the rest fit: their keys work all the same.
void drop_what_does_not_fit(const Canvas& canvas, float room, std::vector<BarButton>& buttons) {
  while (buttons.size() > 1 && total_width(canvas, buttons) > room) {
    int worst = 0;
    for (const BarButton& button : buttons) worst = std::max(worst, button.priority);
    std::erase_if(buttons, [worst](const BarButton& button) { return button.priority == worst; });
  }
}

}  // namespace

void draw_bar(Canvas& canvas, const Box& bar, const LiveFrame& frame, LiveControls& controls) {
  canvas.panel(bar, theme::with_alpha(theme::panel, 1), 0);
  canvas.fill({bar.x, bar.y, bar.width, canvas.px(1)}, theme::line);
  std::vector<BarButton> buttons = buttons_of(frame, controls);
  drop_what_does_not_fit(canvas, bar.width, buttons);
  float x = bar.x + canvas.px(margin);
  for (std::size_t i = 0; i < buttons.size(); ++i) {
    const BarButton& button = buttons[i];
    if (i > 0) x += canvas.px(button.group == buttons[i - 1].group ? gap : group_gap);
    const Box box{x, bar.y + canvas.px(margin), width_of(canvas, button), bar.height - canvas.px(2 * margin)};
    const ImU32 ink = button.action == WindowAction::stop ? theme::red
                      : button.lit                        ? theme::blue
                                                          : theme::text;
    if (canvas.button(box, button.label, binding_of(button.action).key_name, theme::raised, ink))
      controls.perform(button.action, frame.time_s);
    x = box.right();
  }
}

}  // namespace gelslam::viewer::detail
