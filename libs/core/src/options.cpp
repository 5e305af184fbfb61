#include "gelslam/core/options.hpp"

#include <fmt/core.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam {
namespace {

constexpr std::uintmax_t kLargestConfigBytes = 1u << 20;
constexpr const char* kEscapeHint = " (in double quotes, \\ begins an escape: write / instead)";

class OptionReader final : public OptionVisitor {
 public:
  OptionReader(const YAML::Node& root, std::filesystem::path file) : file_(std::move(file)) {
    enter(root, "");
  }

  bool section(const std::string& key, const std::string&, const std::function<void()>& fields) override {
    const YAML::Node node = find(key);
    // Visited even when it is absent: its keys must be known to name the nearest one.
    enter(node, sections_.back().name + key + ".");
    fields();
    leave();
    return static_cast<bool>(node);
  }

  void number(const std::string& key, double& value, double min, double max,
              const std::string& comment) override {
    if (const YAML::Node node = find(key)) value = bounded(node, key, min, max, comment);
  }

  void pair(const std::string& key, std::array<double, 2>& values, double min, double max,
            const std::string& comment) override {
    const YAML::Node node = find(key);
    if (!node) return;
    if (!node.IsSequence() || node.size() != values.size())
      fail_value(node, key, "must be two numbers: [1, 2]");
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = bounded(node[i], key, min, max, comment);
  }

  void integer(const std::string& key, int& value, int min, int max, const std::string&) override {
    const YAML::Node node = find(key);
    if (!node) return;
    double given = 0.0;  // A double, so that 320.0 counts as a whole number, too.
    if (!parse(scalar(node, key, "a whole number"), given) || given != std::floor(given))
      fail_value(node, key, "must be a whole number");
    if (!(given >= min && given <= max))
      fail_value(node, key,
                 "is " + shortened(node.Scalar()) + ", must be from " + std::to_string(min) + " to " +
                     std::to_string(max));
    value = static_cast<int>(given);
  }

  void flag(const std::string& key, bool& value, const std::string&) override {
    const YAML::Node node = find(key);
    if (!node) return;
    scalar(node, key, "true or false");
    if (!YAML::convert<bool>::decode(node, value)) fail_value(node, key, "must be true or false");
  }

  void text(const std::string& key, std::string& value, const std::string&) override {
    if (const YAML::Node node = find(key)) value = scalar(node, key, "text");
  }

  void path(const std::string& key, std::filesystem::path& value, const std::string&) override {
    const YAML::Node node = find(key);
    if (!node) return;
    std::string given = scalar(node, key, "a path");
    if (std::any_of(given.begin(), given.end(), [](char c) { return c >= 0 && c < ' '; }))
      fail_value(node, key, std::string("must be a path") + kEscapeHint);
    const char* const home = std::getenv("HOME");
    if (home != nullptr && given.starts_with("~/")) given.replace(0, 1, home);
    const std::filesystem::path folder = file_.parent_path();
    std::error_code code;
    if (!std::filesystem::exists(folder / given, code)) std::replace(given.begin(), given.end(), '\\', '/');
    value = given.empty() ? "" : std::filesystem::absolute(folder / given).lexically_normal();
  }

  void ignored(const std::string& key) override { find(key); }

  /// To be called when every key has been described.
  void finish() {
    leave();
    if (!unknown_.empty()) fail_unknown(unknown_.front());
  }

 private:
  struct Section {
    YAML::Node node;   // A map, or undefined if the file does not contain it.
    std::string name;  // "gelslam_config.track_config.", or "" at the top
    std::vector<std::string> known;
  };

  struct UnknownKey {
    YAML::Node node;
    std::string section, key;
    std::vector<std::string> known;  // Keys that the section may contain.
  };

  void enter(const YAML::Node& node, const std::string& name) {
    if (node && !node.IsNull() && !node.IsMap())
      fail(node, name.empty() ? "" : without_dot(name), "must be a section of keys");
    sections_.push_back({node && node.IsMap() ? node : YAML::Node(YAML::NodeType::Undefined), name, {}});
  }

  void leave() {
    const Section& section = sections_.back();
    std::vector<std::string> seen;
    if (section.node)
      for (const auto& entry : section.node) check_key(section, entry.first, seen);
    sections_.pop_back();
  }

  void check_key(const Section& section, const YAML::Node& key_node, std::vector<std::string>& seen) {
    if (!key_node.IsScalar()) fail(key_node, "", "a key must be a word");
    const std::string& key = key_node.Scalar();
    if (std::find(section.known.begin(), section.known.end(), key) == section.known.end()) {
      unknown_.push_back({key_node, section.name, key, section.known});
      return;
    }
    if (std::find(seen.begin(), seen.end(), key) != seen.end())
      fail(key_node, section.name + key, "is given twice");
    seen.push_back(key);
  }

  [[noreturn]] void fail_unknown(const UnknownKey& unknown) const {
    std::string hint;
    for (const auto& [section, key] : described_)
      if (key == unknown.key)
        hint = ", it belongs " + (section.empty() ? "to no section" : "into " + without_dot(section));
    if (hint.empty()) {
      const std::string near = nearest_name(unknown.key, unknown.known);
      if (!near.empty()) hint = ", did you mean " + near + "?";
    }
    fail(unknown.node, unknown.section + shortened(unknown.key), "is an unknown key" + hint);
  }

  YAML::Node find(const std::string& key) {
    Section& section = sections_.back();
    section.known.push_back(key);
    described_.emplace_back(section.name, key);
    if (!section.node) return YAML::Node(YAML::NodeType::Undefined);
    const YAML::Node& node = section.node;  // Const, because a look-up must not insert.
    return node[key];
  }

  const std::string& scalar(const YAML::Node& node, const std::string& key,
                            const std::string& expected) const {
    if (!node.IsScalar()) fail_value(node, key, "must be " + expected);
    return node.Scalar();
  }

  double bounded(const YAML::Node& node, const std::string& key, double min, double max,
                 const std::string& comment) const {
    double given = 0.0;
    if (!parse(scalar(node, key, "a number"), given) || !std::isfinite(given))
      fail_value(node, key, "must be a number");
    if (given < min || given > max)
      fail_value(
          node, key,
          fmt::format("is {}, must be from {} to {}: {}", shortened(node.Scalar()), min, max, comment) +
              (comment.starts_with("mm per pixel") && 1 / given >= min && 1 / given <= max
                   ? ", not pixels per mm: perhaps " + short_number(1 / given)
                   : ""));
    return given;
  }

  static bool parse(const std::string& text, double& value) {
    const char* begin = text.data() + (text.starts_with("+") && !text.starts_with("+-") ? 1 : 0);
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(begin, end, value);
    return error == std::errc{} && stop == end;
  }

  static std::string without_dot(const std::string& section) { return section.substr(0, section.size() - 1); }

  static std::string shortened(const std::string& text) {
    return text.size() > 60 ? text.substr(0, 60) + "..." : text;
  }

  [[noreturn]] void fail_value(const YAML::Node& node, const std::string& key,
                               const std::string& problem) const {
    fail(node, sections_.back().name + key, problem);
  }

  [[noreturn]] void fail(const YAML::Node& node, const std::string& key, const std::string& problem) const {
    std::string message = file_.string() + ":" + std::to_string(node.Mark().line + 1) + ": ";
    if (!key.empty()) message += key + " ";
    throw Error(message + problem);
  }

  std::filesystem::path file_;
  std::vector<Section> sections_;
  // Unknown keys are reported only when all keys have been described, as a key may belong to a section that
  // is described later.
  std::vector<UnknownKey> unknown_;
  std::vector<std::pair<std::string, std::string>> described_;  // section and key
};

struct PassedOver final : YAML::EventHandler {
  using Mark = YAML::Mark;
  using Style = YAML::EmitterStyle::value;
  using Anchor = YAML::anchor_t;
  void OnDocumentStart(const Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const Mark&, Anchor) override {}
  void OnAlias(const Mark&, Anchor) override {}
  void OnScalar(const Mark&, const std::string&, Anchor, const std::string&) override {}
  void OnSequenceStart(const Mark&, const std::string&, Anchor, Style) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const Mark&, const std::string&, Anchor, Style) override {}
  void OnMapEnd() override {}
};

/// YAML::LoadAll() does not terminate for text after the document that begins no new one: "{}}".
YAML::Node only_document(const std::string& yaml) {
  std::istringstream stream(yaml);
  YAML::Parser parser(stream);
  PassedOver first;
  parser.HandleNextDocument(first);
  if (parser) throw YAML::Exception(YAML::Mark::null_mark(), "it holds several documents (---), not one");
  return YAML::Load(yaml);
}

std::string read_text(const std::filesystem::path& file) {
  std::error_code code;
  if (!std::filesystem::exists(file, code)) throw Error(file.string() + ": no such file");
  if (!std::filesystem::is_regular_file(file, code))
    throw Error(file.string() + ": not a configuration file");
  if (std::filesystem::file_size(file, code) > kLargestConfigBytes)
    throw Error(file.string() + ": too large for a configuration (more than 1 MiB)");
  return read_file(file);
}

}  // namespace

void read_options_text(std::string_view yaml, const std::filesystem::path& name, const OptionList& options) {
  if (yaml.size() > kLargestConfigBytes)
    throw Error(name.string() + ": too large for a configuration (more than 1 MiB)");
  try {
    OptionReader reader(only_document(std::string(yaml)), name);
    options(reader);
    reader.finish();
  } catch (const YAML::Exception& problem) {
    const std::string line = problem.mark.is_null() ? "" : ":" + std::to_string(problem.mark.line + 1);
    const bool has_escape = yaml.find('\\') != std::string_view::npos;
    throw Error(name.string() + line + ": not valid YAML: " + problem.msg + (has_escape ? kEscapeHint : ""));
  }
}

void read_options(const std::filesystem::path& file, const OptionList& options) {
  read_options_text(read_text(file), file, options);
}

namespace {

std::string quoted_scalar(const std::string& text) {
  YAML::Emitter scalar;
  scalar << YAML::DoubleQuoted << text;
  return scalar.c_str();
}

class OptionWriter final : public OptionVisitor {
 public:
  bool section(const std::string& key, const std::string& comment,
               const std::function<void()>& fields) override {
    line(key, "", comment);
    indent_ += "  ";
    fields();
    indent_.resize(indent_.size() - 2);
    return true;
  }
  void number(const std::string& key, double& value, double min, double max,
              const std::string& comment) override {
    line(key, fmt::format("{}", value), fmt::format("{} ({} to {})", comment, min, max));
  }
  void pair(const std::string& key, std::array<double, 2>& values, double min, double max,
            const std::string& comment) override {
    line(key, fmt::format("[{}, {}]", values[0], values[1]), fmt::format("{} ({} to {})", comment, min, max));
  }
  void integer(const std::string& key, int& value, int min, int max, const std::string& comment) override {
    line(key, fmt::format("{}", value), fmt::format("{} ({} to {})", comment, min, max));
  }
  void flag(const std::string& key, bool& value, const std::string& comment) override {
    line(key, value ? "true" : "false", comment);
  }
  void text(const std::string& key, std::string& value, const std::string& comment) override {
    line(key, quoted_scalar(value), comment);
  }
  void path(const std::string& key, std::filesystem::path& value, const std::string& comment) override {
    line(key, quoted_scalar(value.string()), comment);
  }
  void ignored(const std::string&) override {}

  const std::string& yaml() const { return yaml_; }

 private:
  void line(const std::string& key, const std::string& value, const std::string& comment) {
    yaml_ += indent_ + key + ":" + (value.empty() ? "" : " " + value);
    if (!comment.empty()) yaml_ += "  # " + one_line(comment);
    yaml_ += "\n";
  }

  std::string indent_, yaml_;
};

}  // namespace

std::string write_options(const OptionList& options) {
  OptionWriter writer;
  options(writer);
  return writer.yaml();
}

}  // namespace gelslam
