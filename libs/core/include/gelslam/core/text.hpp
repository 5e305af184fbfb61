#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace gelslam {

/// The candidate a person most likely meant by `word`, or "" if none is near (more than about a third of the
/// letters differ). The first of equally near ones.
std::string nearest_name(std::string_view word, const std::vector<std::string>& candidates);

/// Returns `text` as one line of at most 4 kB: line breaks and other control characters become blanks, runs
/// of blanks become one, and bytes that are no UTF-8 become ?. Messages stay on one line whatever a file
/// contains.
std::string one_line(std::string_view text);

/// Order by which people sort file names: runs of digits compare as numbers, so frame_2 comes before
/// frame_10. A strict weak ordering; equal numbers with different leading zeros are ordered bytewise.
bool natural_less(std::string_view a, std::string_view b);

/// Returns the path in quotes, as messages name files: 'a/b c'.
std::string quoted(const std::filesystem::path& path);

/// Removes these characters at both ends.
std::string trimmed(std::string_view text, std::string_view blanks = " \t");

/// Converts ASCII letters only.
std::string lower_case(std::string text);

/// Returns "1 loop", "0 loops", "2 presses": with the regular plural of the noun.
std::string counted(std::int64_t number, std::string_view noun);

/// Appends a sentence to a text, separated by "; ". Either may be empty.
void append_sentence(std::string& text, std::string_view sentence);

/// "320x240".
std::string size_text(std::int64_t width, std::int64_t height);

/// Returns a number for the user with this many significant digits, without trailing zeros, and without an
/// exponent if possible: "12.35", "0.5", "12346" (digits before the decimal point are never dropped).
std::string short_number(double value, int digits = 4);

/// "4 s", "2:05 min", "1:02:05 h"; rounded to whole seconds.
std::string duration_text(double seconds);

/// "7 B", "812 kB", "1.24 GB" (powers of ten).
std::string bytes_text(std::int64_t bytes);

/// Encodes bytes as text for JSON and HTML (RFC 4648, with padding).
std::string base64(std::string_view bytes);

}  // namespace gelslam
