#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "gelslam/slam/live_slam.hpp"

namespace gelslam {

/// Color of a state: unknown, busy, good, doubtful, bad.
enum class Tone { gray, blue, green, amber, red };

/// The state of a scan as a headline with a color, and below it what it means or what to do.
struct StateWords {
  std::string_view state;  ///< "background", "tracking", "no_contact", ...
  Tone tone = Tone::gray;
  std::string headline, advice;
};
/// `keys` false: do not mention keys, for a user without a keyboard at the scan.
StateWords state_words(const LiveStatus& status, bool keys = true);
/// "lost: too little overlap; touch a place you have seen"
std::string state_line(const LiveStatus& status);
std::string sentences(std::string_view text);  ///< "too little; touch" -> "Too little. Touch."

/// A number shown beside the surface, with its label.
struct Figure {
  const char* label;
  std::string value;
  Tone tone = Tone::gray;
};
std::vector<Figure> usual_figures(const LiveStatus& status);
std::vector<Figure> further_figures(const LiveStatus& status);

/// Requests that a user can make while a scan goes on.
enum class ScanCommand { stop, new_scan };
/// Returns why a command is refused, or "". `another` says whether there is a camera for another scan.
std::string refusal(ScanCommand command, const LiveStatus& status, bool another);

std::string text_of_count(std::int64_t n);  ///< "12 345"
std::string text_of_ms(double ms);          ///< "4.2 ms", "18 ms", "1.3 s"; "-" when it is not known

}  // namespace gelslam
