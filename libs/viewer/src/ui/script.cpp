#include "ui/script.hpp"

#include <GLFW/glfw3.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "live/keys.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr std::size_t max_bytes = 1 << 20;
constexpr double usual_patience_s = 60;

const std::map<std::string, ScriptVerb, std::less<>> verbs = {{"wait", ScriptVerb::wait},
                                                              {"key", ScriptVerb::key},
                                                              {"click", ScriptVerb::click},
                                                              {"move", ScriptVerb::move},
                                                              {"drag", ScriptVerb::drag},
                                                              {"scroll", ScriptVerb::scroll},
                                                              {"screenshot", ScriptVerb::screenshot},
                                                              {"until", ScriptVerb::until},
                                                              {"resize", ScriptVerb::resize},
                                                              {"quit", ScriptVerb::quit}};

const std::map<std::string, int, std::less<>> buttons = {{"left", GLFW_MOUSE_BUTTON_LEFT},
                                                         {"right", GLFW_MOUSE_BUTTON_RIGHT},
                                                         {"middle", GLFW_MOUSE_BUTTON_MIDDLE}};

std::map<std::string, LiveState, std::less<>> states() {
  using enum LiveState;
  std::map<std::string, LiveState, std::less<>> result;
  for (const LiveState state : {background, tracking, no_contact, lost, paused, finishing, finished})
    result.emplace(name(state), state);
  return result;
}

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
    if (problem != std::errc() || stopped != end || !(value >= min && value <= max)) {
      std::ostringstream range;
      range << "'" << text << "' is not " << what << " between " << min << " and " << max;
      fail(range.str());
    }
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
  command.verb = reader.choice("command", verbs);
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
        command.code = reader.choice("mouse button", buttons);
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
      command.state = reader.choice("state", states());
      command.x = reader.done() ? usual_patience_s : reader.number("a time in seconds", 0, 86400);
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
  if (text.size() > max_bytes) throw Error(name + ": too long for a window script (over 1 MB)");
  std::vector<ScriptCommand> commands;
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::istringstream parts(line.substr(0, line.find('#')));
    for (std::string part; std::getline(parts, part, ';');) {
      LineReader reader(name, number, part);
      if (!reader.done()) commands.push_back(parse_command(reader, number));
    }
  }
  return commands;
}

}  // namespace gelslam::viewer::detail
