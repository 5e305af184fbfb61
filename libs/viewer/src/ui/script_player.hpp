#pragma once

#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ui/script.hpp"
#include "ui/window_canvas.hpp"
#include "ui/window_host.hpp"

namespace gelslam::viewer::detail {

/// Does in the window what a script says, as a person would: one thing per frame, through the window's own
/// input.
class ScriptPlayer {
 public:
  ScriptPlayer(std::vector<ScriptCommand> commands, std::string name)
      : name_(std::move(name)), commands_(commands.begin(), commands.end()) {}

  /// What a script can see of the window.
  struct Window {
    LiveState state = LiveState::background;
    Box view;                                       ///< drags and scrolls happen in its middle
    const std::vector<DrawnText>* texts = nullptr;  ///< of the last frame
  };

  /// To be called before each frame; pushes events to `host`. Throws Error when a state or a word is waited
  /// for in vain.
  void play(const Window& window, WindowHost& host, double now_s);

  bool done() const { return commands_.empty() && pending_.empty(); }
  bool wants_to_quit() const { return wants_to_quit_; }
  /// File of a picture that is to be taken of the frame now drawn.
  std::optional<std::string> take_screenshot() { return std::exchange(screenshot_, std::nullopt); }
  /// Writes it, if there is one, of what `host` shows: into `folder`, where the script names no other. Throws
  /// Error.
  void write_screenshot(WindowHost& host, const std::filesystem::path& folder);

 private:
  bool begin(const ScriptCommand& command, const Window& window, WindowHost& host, double now_s);
  void click(const ScriptCommand& command, const Window& window);
  void drag(const ScriptCommand& command, const Window& window);
  [[noreturn]] void fail(const ScriptCommand& command, const std::string& message) const;

  std::string name_;
  std::deque<ScriptCommand> commands_;
  std::deque<InputEvent> pending_;  ///< of the command under way, one per frame
  std::optional<double> command_began_s_;
  std::optional<std::string> screenshot_;
  bool wants_to_quit_ = false;
};

}  // namespace gelslam::viewer::detail
