#include "ui/script.hpp"

#include <GLFW/glfw3.h>
#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/viewer/controls.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr std::size_t kMaxBytes = 1 << 20;
constexpr double kUsualPatienceS = 60;

const std::map<std::string, ScriptVerb, std::less<>> kVerbs = {{"wait", ScriptVerb::wait},
                                                               {"key", ScriptVerb::key},
                                                               {"click", ScriptVerb::click},
                                                               {"move", ScriptVerb::move},
                                                               {"drag", ScriptVerb::drag},
                                                               {"scroll", ScriptVerb::scroll},
                                                               {"screenshot", ScriptVerb::screenshot},
                                                               {"until", ScriptVerb::until},
                                                               {"resize", ScriptVerb::resize},
                                                               {"quit", ScriptVerb::quit}};

const std::map<std::string, int, std::less<>> kButtons = {{"left", GLFW_MOUSE_BUTTON_LEFT},
                                                          {"right", GLFW_MOUSE_BUTTON_RIGHT},
                                                          {"middle", GLFW_MOUSE_BUTTON_MIDDLE}};

/// Of a live scan; every other window is always "finished".
const std::map<std::string, std::string, std::less<>> kStates = {
    {"background", "background"}, {"tracking", "tracking"},
    {"no_contact", "no_contact"}, {"lost", "lost"},
    {"paused", "paused"},         {"finishing", "finishing"},
    {"finished", "finished"},     {"localized", "localized"},
    {"ambiguous", "ambiguous"},   {"not_in_map", "not_in_map"}};

template <class Map>
std::vector<std::string> words_of(const Map& map) {
  std::vector<std::string> words;
  for (const auto& entry : map) words.push_back(entry.first);
  return words;
}

/// The words of one command, handed out one by one; complains with script, line and word.
class LineReader {
 public:
  LineReader(const std::string& script, int line, const std::string& command) : script_(script), line_(line) {
    std::istringstream stream(command);
    for (std::string word; stream >> word;) words_.push_back(word);
  }

  bool done() const { return next_ == words_.size(); }

  std::string word(const std::string& what) {
    if (done()) fail("'" + words_.front() + "' wants " + what + " after it");
    return words_[next_++];
  }

  std::string rest(const std::string& what) {
    std::string text = word(what);
    while (!done()) text += " " + words_[next_++];
    return text;
  }

  double number(const std::string& what, double min, double max) {
    const std::string text = word(what);
    double value = 0;
    const char* end = text.data() + text.size();
    const auto [stopped, problem] = std::from_chars(text.data(), end, value);
    if (problem != std::errc() || stopped != end || !(value >= min && value <= max))
      fail(fmt::format("'{}' is not {} between {:g} and {:g}", text, what, min, max));
    return value;
  }

  template <class Map>
  auto choice(const std::string& what, const Map& map) {
    const std::string text = word(what);
    const auto found = map.find(text);
    if (found == map.end()) fail_unknown(text, what, words_of(map));
    return found->second;
  }

  void end() {
    if (!done()) fail("'" + words_[next_] + "' is one word too many after '" + words_.front() + "'");
  }

  [[noreturn]] void fail(const std::string& message) const {
    throw Error(one_line(script_ + ", line " + std::to_string(line_) + ": " + message));
  }

  [[noreturn]] void fail_unknown(const std::string& text, const std::string& what,
                                 const std::vector<std::string>& known) const {
    std::string message = "'" + text.substr(0, 40) + "' is no " + what;
    const std::string near = nearest_name(text, known);
    if (!near.empty()) {
      message += "; did you mean '" + near + "'?";
    } else {
      message += "; known are";
      for (const std::string& name : known) message += " " + name;
    }
    fail(message);
  }

 private:
  const std::string& script_;
  int line_;
  std::vector<std::string> words_;
  std::size_t next_ = 0;
};

ScriptCommand parse_command(LineReader& reader, int line) {
  ScriptCommand command;
  command.line = line;
  command.verb = reader.choice("command", kVerbs);
  switch (command.verb) {
    case ScriptVerb::wait:
      command.x = reader.number("a time in seconds", 0, 86400);
      break;
    case ScriptVerb::key: {
      const std::string key = reader.word("a key");
      const auto code = key_of_name(key);
      if (!code) reader.fail_unknown(key, "key", key_names());
      command.code = *code;
      break;
    }
    case ScriptVerb::click:
      command.text = reader.rest("the words on a button");
      break;
    case ScriptVerb::drag:
    case ScriptVerb::move:
      command.x = reader.number("a number of pixels", -10000, 10000);
      command.y = reader.number("a number of pixels", -10000, 10000);
      if (command.verb == ScriptVerb::drag && !reader.done())
        command.code = reader.choice("mouse button", kButtons);
      break;
    case ScriptVerb::scroll:
      command.y = reader.number("a number of steps", -100, 100);
      break;
    case ScriptVerb::screenshot: {
      command.text = reader.rest("a file name");
      if (std::filesystem::path(command.text).extension() != ".png")
        reader.fail("'" + command.text + "' does not end in .png");
      break;
    }
    case ScriptVerb::until: {
      command.text = reader.choice("state", kStates);
      command.x = reader.done() ? kUsualPatienceS : reader.number("a time in seconds", 0, 86400);
      break;
    }
    case ScriptVerb::resize:
      command.x = std::floor(reader.number("a width in pixels", 100, 8192));
      command.y = std::floor(reader.number("a height in pixels", 100, 8192));
      break;
    case ScriptVerb::quit:
      break;
  }
  reader.end();
  return command;
}

}  // namespace

std::vector<ScriptCommand> parse_script(const std::string& text, const std::string& name) {
  if (text.size() > kMaxBytes) throw Error(name + ": too long for a window script (over 1 MB)");
  std::vector<ScriptCommand> commands;
  std::istringstream lines(text);
  int number = 0;
  std::size_t line_begin = 0;
  for (std::string line; std::getline(lines, line); line_begin += line.size() + 1) {
    ++number;
    std::istringstream parts(line.substr(0, line.find('#')));
    std::size_t begin = line_begin;
    for (std::string part; std::getline(parts, part, ';'); begin += part.size() + 1) {
      LineReader reader(name, number, part);
      if (reader.done()) continue;
      commands.push_back(parse_command(reader, number));
      commands.back().begin = begin;
    }
  }
  return commands;
}

namespace {

constexpr int kDragSteps = 8;
constexpr double kButtonPatienceS = 5;  // for a button that is yet to appear

InputEvent pointer_at(double x, double y) { return {InputEvent::Kind::pointer, 0, false, x, y}; }

cv::Point2f middle_of(const Box& box) { return {box.x + 0.5F * box.width, box.y + 0.5F * box.height}; }

}  // namespace

ScriptPlayer::ScriptPlayer(const std::string& script, const std::string& name)
    : script_(script), name_(name) {
  for (ScriptCommand& command : parse_script(script, name)) commands_.push_back(std::move(command));
}

std::string ScriptPlayer::rest() const {
  if (commands_.empty()) return "";
  const ScriptCommand& next = commands_.front();
  return std::string(static_cast<std::size_t>(next.line - 1), '\n') + script_.substr(next.begin);
}

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
  const cv::Point2f middle = middle_of(window.view);
  switch (command.verb) {
    case ScriptVerb::wait:
      return waited_s >= command.x;
    case ScriptVerb::key:
      host.push({InputEvent::Kind::key, command.code, true});
      pending_.push_back({InputEvent::Kind::key, command.code, false});
      return true;
    case ScriptVerb::click:
      click(command, window);
      if (pending_.empty() && waited_s > kButtonPatienceS)
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
      if (window.state == command.text) return true;
      if (waited_s > command.x)
        fail(command, "waited in vain for '" + command.text + "'; it is '" + std::string(window.state) + "'");
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
  const cv::Point2f at = middle_of(found->box);
  pending_ = {pointer_at(at.x, at.y),
              pointer_at(at.x, at.y),
              {InputEvent::Kind::button, 0, true},
              {InputEvent::Kind::button, 0, false}};
}

void ScriptPlayer::drag(const ScriptCommand& command, const Window& window) {
  const cv::Point2f from = middle_of(window.view);
  pending_.push_back(pointer_at(from.x, from.y));
  pending_.push_back({InputEvent::Kind::button, command.code, true});
  for (int i = 1; i <= kDragSteps; ++i) {
    const double share = static_cast<double>(i) / kDragSteps;
    pending_.push_back(pointer_at(from.x + share * command.x, from.y + share * command.y));
  }
  pending_.push_back({InputEvent::Kind::button, command.code, false});
}

void ScriptPlayer::write_screenshot(WindowHost& host, const std::filesystem::path& folder) {
  if (!screenshot_) return;
  write_png(folder / *std::exchange(screenshot_, std::nullopt), host.read());
}

}  // namespace gelslam::viewer::detail
