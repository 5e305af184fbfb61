#include "live/keys.hpp"

#include <GLFW/glfw3.h>

#include <cctype>
#include <map>

#include "gelslam/core/text.hpp"

namespace gelslam::viewer::detail {
namespace {

std::map<std::string, int, std::less<>> named_keys() {
  std::map<std::string, int, std::less<>> keys = {
      {"space", GLFW_KEY_SPACE}, {"enter", GLFW_KEY_ENTER}, {"esc", GLFW_KEY_ESCAPE},
      {"tab", GLFW_KEY_TAB},     {"left", GLFW_KEY_LEFT},   {"right", GLFW_KEY_RIGHT},
      {"up", GLFW_KEY_UP},       {"down", GLFW_KEY_DOWN},   {"backspace", GLFW_KEY_BACKSPACE},
      {"plus", GLFW_KEY_EQUAL},  {"minus", GLFW_KEY_MINUS},
  };
  for (char letter = 'a'; letter <= 'z'; ++letter) keys[std::string(1, letter)] = GLFW_KEY_A + (letter - 'a');
  for (char digit = '0'; digit <= '9'; ++digit) keys[std::string(1, digit)] = GLFW_KEY_0 + (digit - '0');
  for (int i = 1; i <= 12; ++i) keys["f" + std::to_string(i)] = GLFW_KEY_F1 + (i - 1);
  return keys;
}

}  // namespace

const std::vector<KeyBinding<WindowAction>>& window_keys() {
  using enum WindowAction;
  static const std::vector<KeyBinding<WindowAction>> bindings = {
      {pause, GLFW_KEY_SPACE, 0, "Space", "Pause, go on"},
      {undo_trial, GLFW_KEY_U, 0, "U", "Undo the last trial"},
      {new_scan, GLFW_KEY_N, 0, "N", "New scan (asks first)"},
      {save, GLFW_KEY_S, 0, "S", "Save now, and go on"},
      {stop, GLFW_KEY_Q, GLFW_KEY_ESCAPE, "Q", "Stop and save (asks first)"},
      {screenshot, GLFW_KEY_P, 0, "P", "Picture of this window (PNG)"},
      {export_mesh, GLFW_KEY_E, 0, "E", "Export the mesh (PLY, OBJ, STL)"},
      {shading_lit, GLFW_KEY_1, GLFW_KEY_KP_1, "1", "Clay"},
      {shading_matcap, GLFW_KEY_2, GLFW_KEY_KP_2, "2", "Polished"},
      {shading_curvature, GLFW_KEY_3, GLFW_KEY_KP_3, "3", "Curvature"},
      {next_color, GLFW_KEY_C, 0, "C", "Colors by what is known"},
      {follow, GLFW_KEY_F, 0, "F", "Follow the touch"},
      {reset_view, GLFW_KEY_R, 0, "R", "Show all"},
      {trajectory, GLFW_KEY_T, 0, "T", "Trajectory"},
      {pose_graph, GLFW_KEY_G, 0, "G", "Pose graph"},
      {grid, GLFW_KEY_M, 0, "M", "Millimetre grid"},
      {panels, GLFW_KEY_TAB, 0, "Tab", "Hide or show the panels"},
      {help, GLFW_KEY_F1, GLFW_KEY_H, "H", "This help"},
  };
  return bindings;
}

std::optional<int> key_of_name(std::string_view name) {
  static const auto keys = named_keys();
  const auto found = keys.find(lower_case(std::string(name)));
  return found == keys.end() ? std::nullopt : std::optional(found->second);
}

std::vector<std::string> key_names() {
  std::vector<std::string> names;
  for (const auto& [name, code] : named_keys()) names.push_back(name);
  return names;
}

}  // namespace gelslam::viewer::detail
