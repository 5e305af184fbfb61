#include "gelslam/viewer/controls.hpp"

#include <algorithm>

namespace gelslam::viewer {
namespace {

constexpr std::size_t kMaxToasts = 4;

const char* name_of(SceneColor color) {
  static constexpr const char* kNames[] = {"plain", "confidence", "height", "distance", "certainty"};
  return kNames[static_cast<std::size_t>(color)];
}

}  // namespace

ActionRow common_row(Action action) {
  using enum Action;
  static const std::vector<ActionRow> rows = {
      {curvature, {GLFW_KEY_K}, "K", "Curvature", 2, 10, "Shading by curvature"},
      {next_color, {GLFW_KEY_C}, "C", "Colors", 2, 9, "Next color scale"},
      {follow, {GLFW_KEY_F}, "F", "Follow", 2, 7, "Follow the touch"},
      {show_all, {GLFW_KEY_R}, "R", "Show all", 2, 6, "Show all"},
      {trajectory, {GLFW_KEY_T}, "T", "Trajectory", 2, 8, "Trajectory"},
      {pose_graph, {GLFW_KEY_G}, "G", "Graph", 2, 8, "Pose graph"},
      {not_in_mesh, {GLFW_KEY_M}, "M", "Missing", 2, 8, "What was touched and is not in the mesh"},
      {screenshot, {GLFW_KEY_P}, "P", "Picture", 1, 6, "Picture of this window (PNG)"},
      {panels, {GLFW_KEY_TAB}, "Tab", "", 0, 0, "Hide or show the panels"},
      {help, {GLFW_KEY_H, GLFW_KEY_F1}, "H", "Help", 4, 2, "This help"},
  };
  return *std::find_if(rows.begin(), rows.end(),
                       [action](const ActionRow& row) { return row.action == action; });
}

void Controls::press_key(int code, double now_s) {
  const auto has_key = [code](const auto& of) { return std::ranges::find(of.keys, code) != of.keys.end(); };
  if (question_) {
    const auto& answers = question_->answers;
    const auto found = std::ranges::find_if(answers, has_key);
    if (found != answers.end()) answer(static_cast<std::size_t>(found - answers.begin()), now_s);
    return;
  }
  const auto row = std::ranges::find_if(rows_, has_key);
  if (std::exchange(shows_help_, false) &&
      (code == GLFW_KEY_ESCAPE || row == rows_.end() || row->action == Action::help))
    return;
  if (row != rows_.end()) perform(row->action, now_s);
}

void Controls::answer(std::size_t index, double now_s) {
  const Question question = *std::exchange(question_, std::nullopt);
  if (const auto& run = question.answers.at(index).run) run(now_s);
}

void Controls::perform(Action action, double now_s) {
  if (action == Action::help)
    shows_help_ = !shows_help_;
  else if (action == Action::panels)
    shows_panels_ = !shows_panels_;
  else if (action == Action::screenshot)
    screenshot_ = true;
  else
    act(action, now_s);
}

void Controls::add(Toast toast) {
  // If the same text comes again (a key held down), it is shown for longer and not twice.
  std::erase_if(toasts_, [&toast](const Toast& old) { return old.text == toast.text; });
  toasts_.push_back(std::move(toast));
  if (toasts_.size() > kMaxToasts) toasts_.pop_front();
}

bool Controls::drop_old_toasts(double now_s) {
  return std::erase_if(toasts_, [now_s](const Toast& toast) { return toast.until_s <= now_s; }) > 0;
}

void SceneControls::act(Action action, double now_s) {
  if (action == Action::curvature)
    style_.shading = style_.shading == SceneShading::clay ? SceneShading::curvature : SceneShading::clay;
  if (action == Action::trajectory) style_.trajectory = !style_.trajectory;
  if (action == Action::not_in_mesh) style_.not_in_mesh = !style_.not_in_mesh;
  if (action == Action::pose_graph) style_.edges = style_.keyframes = !style_.edges;
  if (action == Action::next_color) {
    const auto now = std::find(colors_.begin(), colors_.end(), style_.color);
    style_.color = now == colors_.end() || now + 1 == colors_.end() ? colors_.front() : *(now + 1);
    say(std::string("Colors: ") + name_of(style_.color), now_s);
  }
  if (action == Action::follow) {
    follows_ = !follows_;
    say(follows_ ? "The view follows the touch." : "The view stays where it is.", now_s);
  }
  if (action == Action::show_all) show_all_ = true;
  if (action == Action::close) close();
}

ButtonLook SceneControls::button(const ActionRow& row) const {
  const auto is_on = [this](Action action) {
    switch (action) {
      case Action::curvature:
        return style_.shading == SceneShading::curvature;
      case Action::trajectory:
        return style_.trajectory;
      case Action::pose_graph:
        return style_.edges;
      case Action::not_in_mesh:
        return style_.not_in_mesh;
      case Action::next_color:
        return style_.color != colors_.front();
      case Action::follow:
        return follows_;
      case Action::help:
        return shows_help();
      default:
        return false;
    }
  };
  return {true, row.label, is_on(row.action) ? theme::kBlue : theme::kText};
}

std::vector<std::pair<std::string, std::string>> SceneControls::mouse_help() const {
  return {{"Left drag", "Turn"},
          {"Right drag", "Move"},
          {"Wheel", "Zoom"},
          {"Double click", "Turn about this place"}};
}

}  // namespace gelslam::viewer
