#include "option_checks.hpp"

#include <charconv>
#include <filesystem>

#include "gelslam/core/text.hpp"

namespace gelslam {
namespace {

std::string refuse_other_ending(const std::string& path, const std::string& ending, const std::string& what) {
  if (lower_case(std::filesystem::path(path).extension().string()) == ending) return "";
  return path + ": " + what + "; give a name that ends in " + ending;
}

}  // namespace

std::string refuse_unless_png(const std::string& path) {
  return refuse_other_ending(path, ".png", "pictures are written as PNG");
}

std::string refuse_unless_html(const std::string& path) {
  return refuse_other_ending(path, ".html", "the page is written as HTML");
}

CLI::Validator number_between(double least, double most) {
  const std::string range = format_text("%.10g to %.10g", least, most);
  const auto check = [least, most, range](const std::string& text) -> std::string {
    double value = 0;
    const char* end = text.data() + text.size();
    const auto [rest, code] = std::from_chars(text.data(), end, value);
    if (code == std::errc() && rest == end && value >= least && value <= most) return "";
    return text + " is no number from " + range +
           (rest != end && *rest == ',' ? " (write a point, not a comma)" : "");
  };
  return CLI::Validator(check, range);
}

}  // namespace gelslam
