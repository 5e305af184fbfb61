#include "gelslam/viewer/controls.hpp"

#include <GLFW/glfw3.h>

#include <algorithm>
#include <map>
#include <sstream>

namespace gelslam::viewer {
namespace {

constexpr std::size_t kMaxToasts = 4;

std::map<std::string, int, std::less<>> named_keys() {
  std::map<std::string, int, std::less<>> keys = {{"space", GLFW_KEY_SPACE},
                                                  {"enter", GLFW_KEY_ENTER},
                                                  {"esc", GLFW_KEY_ESCAPE},
                                                  {"tab", GLFW_KEY_TAB},
                                                  {"f1", GLFW_KEY_F1},
                                                  {"left", GLFW_KEY_LEFT},
                                                  {"right", GLFW_KEY_RIGHT},
                                                  {"up", GLFW_KEY_UP},
                                                  {"down", GLFW_KEY_DOWN},
                                                  {"backspace", GLFW_KEY_BACKSPACE},
                                                  {"plus", GLFW_KEY_EQUAL},
                                                  {"minus", GLFW_KEY_MINUS},
                                                  {"delete", GLFW_KEY_DELETE},
                                                  {"pageup", GLFW_KEY_PAGE_UP},
                                                  {"kp_add", GLFW_KEY_KP_ADD},
                                                  {"pagedown", GLFW_KEY_PAGE_DOWN},
                                                  {"kp_subtract", GLFW_KEY_KP_SUBTRACT},
                                                  {"kp_enter", GLFW_KEY_KP_ENTER},
                                                  {"slash", GLFW_KEY_SLASH},
                                                  {"bracket", GLFW_KEY_RIGHT_BRACKET}};
  for (char letter = 'a'; letter <= 'z'; ++letter) keys[std::string(1, letter)] = GLFW_KEY_A + (letter - 'a');
  return keys;
}

bool holds_key(const std::string& keys, int code) {
  std::istringstream names(keys);
  for (std::string name; names >> name;)
    if (key_of_name(name) == code) return true;
  return false;
}

const char* name_of(SceneColor color) {
  static constexpr const char* kNames[] = {"plain", "confidence", "height", "distance", "certainty"};
  return kNames[static_cast<std::size_t>(color)];
}

}  // namespace

ActionRow common_row(Action action) {
  using enum Action;
  static const std::vector<ActionRow> rows = {
      {curvature, "k", "K", "Curvature", 2, 10, "Shading by curvature"},
      {next_color, "c", "C", "Colors", 2, 9, "Next color scale"},
      {follow, "f", "F", "Follow", 2, 7, "Follow the touch"},
      {show_all, "r", "R", "Show all", 2, 6, "Show all"},
      {trajectory, "t", "T", "Trajectory", 2, 8, "Trajectory"},
      {pose_graph, "g", "G", "Graph", 2, 8, "Pose graph"},
      {screenshot, "p", "P", "Picture", 1, 6, "Picture of this window (PNG)"},
      {panels, "tab", "Tab", "", 0, 0, "Hide or show the panels"},
      {help, "h f1", "H", "Help", 4, 2, "This help"},
  };
  return *std::find_if(rows.begin(), rows.end(),
                       [action](const ActionRow& row) { return row.action == action; });
}

std::optional<int> key_of_name(std::string_view name) {
  static const auto keys = named_keys();
  const auto found = keys.find(name);
  return found == keys.end() ? std::nullopt : std::optional(found->second);
}

void Controls::press_key(int code, double now_s) {
  if (question_) {
    const auto& answers = question_->answers;
    const auto found = std::find_if(answers.begin(), answers.end(),
                                    [code](const Answer& a) { return holds_key(a.keys, code); });
    if (found != answers.end()) answer(static_cast<std::size_t>(found - answers.begin()), now_s);
    return;
  }
  const auto row = std::find_if(rows_.begin(), rows_.end(),
                                [code](const ActionRow& r) { return holds_key(r.keys, code); });
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

void Controls::say(std::string text, double now_s, double seconds) {
  add_toast({std::move(text), false, now_s + seconds});
}

void Controls::complain(std::string text, double now_s, double seconds) {
  add_toast({std::move(text), true, now_s + seconds});
}

void Controls::add_toast(Toast toast) {
  // The same text again (a key held down) is shown longer, not twice.
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
