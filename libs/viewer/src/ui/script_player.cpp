#include "ui/script_player.hpp"

#include <algorithm>

#include "gelslam/core/error.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr int drag_steps = 8;
constexpr double button_patience_s = 5;  // for a button that is yet to appear

InputEvent pointer_at(double x, double y) { return {InputEvent::Kind::pointer, 0, false, x, y}; }

ImVec2 middle_of(const Box& box) { return {box.x + 0.5F * box.width, box.y + 0.5F * box.height}; }

}  // namespace

void ScriptPlayer::fail(const ScriptCommand& command, const std::string& message) const {
  throw Error(name_ + ", line " + std::to_string(command.line) + ": " + message);
}

void ScriptPlayer::play(const Window& window, WindowHost& host, double now_s) {
  if (!pending_.empty()) {
    host.push(pending_.front());
    pending_.pop_front();
    return;
  }
  if (commands_.empty()) return;
  if (!command_began_s_) command_began_s_ = now_s;
  if (!begin(commands_.front(), window, host, now_s)) return;
  commands_.pop_front();
  command_began_s_.reset();
}

/// False when the command has to wait, and is to be tried again in the next frame.
bool ScriptPlayer::begin(const ScriptCommand& command, const Window& window, WindowHost& host, double now_s) {
  const double waited_s = now_s - *command_began_s_;
  const ImVec2 middle = middle_of(window.view);
  switch (command.verb) {
    case ScriptVerb::wait:
      return waited_s >= command.x;
    case ScriptVerb::key:
      host.push({InputEvent::Kind::key, command.code, true});
      pending_.push_back({InputEvent::Kind::key, command.code, false});
      return true;
    case ScriptVerb::click:
      click(command, window);
      if (pending_.empty() && waited_s > button_patience_s)
        fail(command, "'" + command.text + "' is nowhere in the window");
      return !pending_.empty();
    case ScriptVerb::move:
      host.push(pointer_at(command.x, command.y));
      return true;
    case ScriptVerb::drag:
      drag(command, window);
      return true;
    case ScriptVerb::scroll:
      host.push(pointer_at(middle.x, middle.y));
      pending_.push_back({InputEvent::Kind::scroll, 0, false, 0, command.y});
      return true;
    case ScriptVerb::screenshot:
      screenshot_ = command.text;
      return true;
    case ScriptVerb::until:
      if (window.state == command.state) return true;
      if (waited_s > command.x)
        fail(command, "waited in vain for '" + std::string(name(command.state)) + "'; it is '" +
                          std::string(name(window.state)) + "'");
      return false;
    case ScriptVerb::resize:
      host.resize(static_cast<int>(command.x), static_cast<int>(command.y));
      return true;
    case ScriptVerb::quit:
      wants_to_quit_ = true;
      return true;
  }
  return true;
}

void ScriptPlayer::click(const ScriptCommand& command, const Window& window) {
  if (window.texts == nullptr) return;
  // The last one that says so: a dialog lies over the rest.
  const auto found = std::find_if(window.texts->rbegin(), window.texts->rend(),
                                  [&command](const DrawnText& drawn) { return drawn.text == command.text; });
  if (found == window.texts->rend()) return;
  const ImVec2 at = middle_of(found->box);
  pending_ = {pointer_at(at.x, at.y),
              pointer_at(at.x, at.y),
              {InputEvent::Kind::button, 0, true},
              {InputEvent::Kind::button, 0, false}};
}

void ScriptPlayer::drag(const ScriptCommand& command, const Window& window) {
  const ImVec2 from = middle_of(window.view);
  pending_.push_back(pointer_at(from.x, from.y));
  pending_.push_back({InputEvent::Kind::button, command.code, true});
  for (int i = 1; i <= drag_steps; ++i) {
    const double share = static_cast<double>(i) / drag_steps;
    pending_.push_back(pointer_at(from.x + share * command.x, from.y + share * command.y));
  }
  pending_.push_back({InputEvent::Kind::button, command.code, false});
}

void ScriptPlayer::write_screenshot(WindowHost& host, const std::filesystem::path& folder) {
  const auto name = take_screenshot();
  if (!name) return;
  const std::filesystem::path path(*name);
  write_png((path.is_absolute() ? path : folder / path).string(), host.read());
}

}  // namespace gelslam::viewer::detail
