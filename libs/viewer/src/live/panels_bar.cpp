#include <vector>

#include "ui/button_bar.hpp"
#include "ui/panels.hpp"

namespace gelslam::viewer::detail {
namespace {

struct BarButton {
  WindowAction action;
  std::string label;
  int group, priority;  ///< see BarItem
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
  buttons.push_back({next_color, "Colors", 2, 9, style.color != SceneColor::plain});
  buttons.push_back({shading_lit, "Clay", 3, 10, style.shading == SceneShading::lit});
  buttons.push_back({shading_matcap, "Polish", 3, 10, style.shading == SceneShading::matcap});
  buttons.push_back({shading_curvature, "Curvature", 3, 10, style.shading == SceneShading::curvature});
  buttons.push_back({help, "Help", 4, 2});
  return buttons;
}

ImU32 ink_of(const BarButton& button) {
  if (button.action == WindowAction::stop) return theme::red;
  return button.lit ? theme::blue : theme::text;
}

}  // namespace

void draw_bar(Canvas& canvas, const Box& bar, const LiveFrame& frame, LiveControls& controls) {
  const std::vector<BarButton> buttons = buttons_of(frame, controls);
  std::vector<BarItem> items;
  for (const BarButton& button : buttons)
    items.push_back({button.label, key_name_of(window_keys(), button.action), button.group, button.priority,
                     ink_of(button)});
  if (const auto clicked = draw_button_bar(canvas, bar, items))
    controls.perform(buttons[*clicked].action, frame.time_s);
}

}  // namespace gelslam::viewer::detail
