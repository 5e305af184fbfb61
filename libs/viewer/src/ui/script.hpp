#pragma once

#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gelslam/viewer/ui.hpp"
#include "gelslam/viewer/window_host.hpp"

namespace gelslam::viewer::detail {

enum class ScriptVerb { wait, key, click, move, drag, scroll, screenshot, until, resize, quit };

/// One line of a window script; which fields count depends on the verb.
struct ScriptCommand {
  ScriptVerb verb = ScriptVerb::wait;
  int line = 0;
  std::size_t begin = 0;  ///< in the script
  double x = 0,
         y = 0;      ///< wait: s in x; move, drag, resize: px; scroll: steps in y; until: patience in s in x
  int code = 0;      ///< key: GLFW code; drag: GLFW mouse button
  std::string text;  ///< click: the text there; screenshot: file; until: state
};

/// Commands of a script, one per line or between semicolons; "#" begins a comment. Throws Error that names
/// `name`, line and word. Format: docs/viewer.md.
std::vector<ScriptCommand> parse_script(const std::string& text, const std::string& name);

/// Does in the window what a script says, one thing per frame, through the window's own input.
class ScriptPlayer {
 public:
  ScriptPlayer(const std::string& script, const std::string& name);

  /// What a script can see of the window.
  struct Window {
    std::string_view state;
    Box view;                                       ///< drags and scrolls happen in its middle
    const std::vector<DrawnText>* texts = nullptr;  ///< of the last frame
  };

  /// To be called before each frame; pushes events to `host`. Throws Error when a state or a text does not
  /// come.
  void play(const Window& window, WindowHost& host, double now_s);

  bool done() const { return commands_.empty() && pending_.empty(); }
  bool wants_to_quit() const { return wants_to_quit_; }
  /// The script from the first command that is not done, with line numbers as before.
  std::string rest() const;
  /// Writes the picture that the script asked for, if it did, of what `host` shows: into `folder`, where the
  /// script names no other. Throws Error.
  void write_screenshot(WindowHost& host, const std::filesystem::path& folder);

 private:
  bool begin(const ScriptCommand& command, const Window& window, WindowHost& host, double now_s);
  void click(const ScriptCommand& command, const Window& window);
  void drag(const ScriptCommand& command, const Window& window);
  [[noreturn]] void fail(const ScriptCommand& command, const std::string& message) const;

  std::string script_, name_;
  std::deque<ScriptCommand> commands_;
  std::deque<InputEvent> pending_;  ///< of the command under way, one per frame
  std::optional<double> command_began_s_;
  std::optional<std::string> screenshot_;
  bool wants_to_quit_ = false;
};

}  // namespace gelslam::viewer::detail
