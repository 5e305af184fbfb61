#include "npy_header.hpp"

#include <charconv>
#include <stdexcept>

namespace gelslam::detail {
namespace {

constexpr std::size_t kMaxDimensions = 32;  // numpy's own limit

class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {}

  bool accept(std::string_view token) {
    skip_blanks();
    if (!text_.starts_with(token)) return false;
    text_.remove_prefix(token.size());
    return true;
  }

  void expect(std::string_view token) {
    if (!accept(token)) throw std::invalid_argument("its header lacks '" + std::string(token) + "'");
  }

  std::string quoted() {
    const char quote = accept("'") ? '\'' : '"';
    if (quote == '"') expect("\"");
    const std::size_t end = text_.find(quote);
    if (end == std::string_view::npos) throw std::invalid_argument("its header has an open quote");
    std::string word(text_.substr(0, end));
    text_.remove_prefix(end + 1);
    return word;
  }

  bool boolean() {
    if (accept("True")) return true;
    expect("False");
    return false;
  }

  std::size_t number() {
    skip_blanks();
    std::size_t value = 0;
    const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), value);
    if (error != std::errc{}) throw std::invalid_argument("its header has a bad number in 'shape'");
    text_.remove_prefix(static_cast<std::size_t>(end - text_.data()));
    accept("L");  // written by Python 2
    return value;
  }

  bool at_end() {
    skip_blanks();
    return text_.empty();
  }

 private:
  void skip_blanks() {
    const std::size_t first = text_.find_first_not_of(" \t\r\n");
    text_.remove_prefix(first == std::string_view::npos ? text_.size() : first);
  }

  std::string_view text_;
};

std::vector<std::size_t> tuple(Scanner& scanner) {
  std::vector<std::size_t> values;
  scanner.expect("(");
  while (!scanner.accept(")")) {
    values.push_back(scanner.number());
    if (values.size() > kMaxDimensions) throw std::invalid_argument("it has too many dimensions");
    if (!scanner.accept(",")) {
      scanner.expect(")");
      break;
    }
  }
  return values;
}

}  // namespace

NpyHeader parse_npy_header(std::string_view text) {
  Scanner scanner(text);
  NpyHeader header;
  bool has_descr = false, has_order = false, has_shape = false;
  const auto once = [](bool& seen) {
    if (seen) throw std::invalid_argument("its header says something twice");
    seen = true;
  };
  scanner.expect("{");
  while (!scanner.accept("}")) {
    const std::string key = scanner.quoted();
    scanner.expect(":");
    if (key == "descr") {
      once(has_descr);
      header.descr = scanner.quoted();
    } else if (key == "fortran_order") {
      once(has_order);
      header.fortran_order = scanner.boolean();
    } else if (key == "shape") {
      once(has_shape);
      header.shape = tuple(scanner);
    } else {
      throw std::invalid_argument("its header has an unknown entry");
    }
    if (!scanner.accept(",")) {
      scanner.expect("}");
      break;
    }
  }
  if (!scanner.at_end()) throw std::invalid_argument("its header goes on after the closing brace");
  if (!has_descr || !has_order || !has_shape) throw std::invalid_argument("its header is incomplete");
  return header;
}

std::string format_npy_header(const NpyHeader& header) {
  std::string shape;
  for (const std::size_t extent : header.shape) shape += (shape.empty() ? "" : ", ") + std::to_string(extent);
  if (header.shape.size() == 1) shape += ",";
  return "{'descr': '" + header.descr + "', 'fortran_order': " + (header.fortran_order ? "True" : "False") +
         ", 'shape': (" + shape + "), }";
}

}  // namespace gelslam::detail
