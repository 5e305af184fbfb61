#pragma once

#include <algorithm>
#include <optional>
#include <vector>

namespace gelslam::viewer::detail {

/// A key of one of the windows, and what it asks for.
template <typename Action>
struct KeyBinding {
  Action action;
  int key;               ///< GLFW code
  int second_key;        ///< another key for the same; 0: none
  const char* key_name;  ///< as people read it: "Space"
  const char* what;      ///< in the help: "Pause, go on"
};

/// The first key for `action`, which must have one.
template <typename Action>
const char* key_name_of(const std::vector<KeyBinding<Action>>& bindings, Action action) {
  return std::find_if(bindings.begin(), bindings.end(),
                      [action](const KeyBinding<Action>& binding) { return binding.action == action; })
      ->key_name;
}

template <typename Action>
std::optional<Action> action_of_key(const std::vector<KeyBinding<Action>>& bindings, int key) {
  for (const KeyBinding<Action>& binding : bindings)
    if (binding.key == key || (binding.second_key != 0 && binding.second_key == key)) return binding.action;
  return std::nullopt;
}

}  // namespace gelslam::viewer::detail
