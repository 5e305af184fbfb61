#include "gelslam/core/text.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "gelslam/core/error.hpp"

namespace gelslam {

Error::Error(const std::string& message) : std::runtime_error(one_line(message)) {}

namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Returns the digits that begin at `at`, without leading zeros.
std::string_view number_at(std::string_view text, std::size_t at, std::size_t& end) {
  end = at;
  while (end < text.size() && is_digit(text[end])) ++end;
  while (at + 1 < end && text[at] == '0') ++at;
  return text.substr(at, end - at);
}

/// Returns the number of bytes of the UTF-8 character at the beginning; 0 if it is not valid.
std::size_t letter_bytes(std::string_view text) {
  const auto first = static_cast<unsigned char>(text[0]);
  const std::size_t bytes = first < 0x80   ? 1
                            : first < 0xc2 ? 0
                            : first < 0xe0 ? 2
                            : first < 0xf0 ? 3
                            : first < 0xf5 ? 4
                                           : 0;
  if (bytes > text.size()) return 0;
  for (std::size_t i = 1; i < bytes; ++i)
    if ((static_cast<unsigned char>(text[i]) & 0xc0) != 0x80) return 0;
  return bytes;
}

/// Returns the least number of insertions, deletions and replacements of one byte, and swaps of two
/// neighboring bytes, that turn `a` into `b` (optimal string alignment: no byte is edited twice).
int edit_distance(std::string_view a, std::string_view b) {
  // Three rows of the table: the current one and, because a swap looks two letters back, two before it.
  std::vector<int> before_previous, previous(b.size() + 1), row(b.size() + 1);
  std::iota(previous.begin(), previous.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({previous[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1), previous[j] + 1, row[j - 1] + 1});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], before_previous[j - 2] + 1);
    }
    before_previous = previous;
    previous = row;
  }
  return previous[b.size()];
}

}  // namespace

std::string nearest_name(std::string_view word, const std::vector<std::string>& candidates) {
  // A longer word is not a misspelling of a candidate, and the table of edits would take long.
  constexpr std::size_t longest_word = 100;
  if (word.size() > longest_word) return "";
  std::string best;
  int best_distance = static_cast<int>(std::max<std::size_t>(1, word.size() / 3)) + 1;
  for (const std::string& candidate : candidates) {
    const int distance = edit_distance(word, candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

std::string one_line(std::string_view text) {
  constexpr std::size_t kMaxBytes = 4000;
  std::string line;
  while (!text.empty() && line.size() < kMaxBytes) {
    const std::string_view letter = text.substr(0, letter_bytes(text));
    text.remove_prefix(std::max<std::size_t>(letter.size(), 1));
    const bool blank = letter.size() == 1
                           ? static_cast<unsigned char>(letter[0]) <= ' ' || letter[0] == '\x7f'
                           : letter.starts_with('\xc2') && letter[1] < '\xa0';
    if (!blank)
      line += letter.empty() ? "?" : letter;
    else if (!line.empty() && line.back() != ' ')
      line += ' ';
  }
  if (!line.empty() && line.back() == ' ') line.pop_back();
  return text.empty() ? line : line + "...";
}

bool natural_less(std::string_view a, std::string_view b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (is_digit(a[i]) && is_digit(b[j])) {
      std::size_t i_end = 0, j_end = 0;
      const std::string_view m = number_at(a, i, i_end), n = number_at(b, j, j_end);
      if (m.size() != n.size()) return m.size() < n.size();
      if (m != n) return m < n;
      i = i_end;
      j = j_end;
    } else {
      if (a[i] != b[j]) return static_cast<unsigned char>(a[i]) < static_cast<unsigned char>(b[j]);
      ++i;
      ++j;
    }
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;
}

std::string quoted(const std::filesystem::path& path) { return "'" + path.string() + "'"; }

std::string trimmed(std::string_view text, std::string_view blanks) {
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return "";
  return std::string(text.substr(first, text.find_last_not_of(blanks) - first + 1));
}

std::string lower_case(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

std::string counted(std::int64_t number, std::string_view noun) {
  const bool hisses =
      noun.ends_with("s") || noun.ends_with("sh") || noun.ends_with("ch") || noun.ends_with("x");
  return fmt::format("{} {}{}", number, noun, number == 1 ? "" : hisses ? "es" : "s");
}

void append_sentence(std::string& text, std::string_view sentence) {
  if (!text.empty() && !sentence.empty()) text += "; ";
  text += sentence;
}

std::string size_text(std::int64_t width, std::int64_t height) { return fmt::format("{}x{}", width, height); }

std::string short_number(double value, int digits) {
  const bool only_whole_digits = std::isfinite(value) && std::abs(value) >= std::pow(10.0, digits) - 0.5;
  return only_whole_digits && std::abs(value) < 1e15 ? fmt::format("{:.0f}", value)
                                                     : fmt::format("{:.{}g}", value, digits);
}

std::string duration_text(double seconds) {
  const auto whole = static_cast<std::int64_t>(std::clamp(seconds + 0.5, 0.0, 1e9));
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{}:{:02} min", whole / 60, whole % 60);
  return fmt::format("{}:{:02}:{:02} h", whole / 3600, whole / 60 % 60, whole % 60);
}

std::string bytes_text(std::int64_t bytes) {
  if (bytes < 1000) return fmt::format("{} B", bytes);
  constexpr std::array<const char*, 4> kUnits = {"kB", "MB", "GB", "TB"};
  std::size_t unit = 0;
  double value = static_cast<double>(bytes) / 1e3;
  while (value >= 999.5 && unit + 1 < kUnits.size()) {
    value /= 1e3;
    ++unit;
  }
  return fmt::format("{:.{}f} {}", value, value < 9.995 ? 2 : value < 99.95 ? 1 : 0, kUnits[unit]);
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    unsigned group = 0;
    for (std::size_t j = 0; j < 3; ++j)
      group = group << 8 | (k + j < bytes.size() ? static_cast<unsigned char>(bytes[k + j]) : 0U);
    for (std::size_t j = 0; j < 4; ++j)
      text += k + j <= bytes.size() ? kLetters[group >> (18 - 6 * j) & 63U] : '=';
  }
  return text;
}

}  // namespace gelslam
