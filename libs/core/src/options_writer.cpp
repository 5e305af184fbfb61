#include <fmt/core.h>

#include "gelslam/core/options.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam {
namespace {

/// A YAML double-quoted scalar, safe for any bytes.
std::string quoted_scalar(const std::string& text) {
  constexpr char digits[] = "0123456789abcdef";
  std::string result = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      result += {'\\', c};
    } else if (byte < 0x20 || byte == 0x7f) {
      result += {'\\', 'x', digits[byte >> 4], digits[byte & 15]};
    } else {
      result += c;
    }
  }
  return result + "\"";
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
