#pragma once

#include <string>
#include <vector>

#include "live/status_text.hpp"

namespace gelslam::viewer::detail {

enum class ScriptVerb { wait, key, click, move, drag, scroll, screenshot, until, resize, quit };

/// One line of a window script; which fields count depends on the verb.
struct ScriptCommand {
  ScriptVerb verb = ScriptVerb::wait;
  int line = 0;
  double x = 0,
         y = 0;  ///< wait: s in x; move, drag, resize: px; scroll: steps in y; until: patience in s in x
  int code = 0;  ///< key: GLFW code; drag: GLFW mouse button
  LiveState state = LiveState::background;  ///< until
  std::string text;                         ///< click: what is written there; screenshot: file
};

/// Commands of a script, one per line or between semicolons; "#" begins a comment. Throws Error that names
/// `name`, line and word. Format: docs/viewer.md.
std::vector<ScriptCommand> parse_script(const std::string& text, const std::string& name);

}  // namespace gelslam::viewer::detail
