#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "gelslam/slam/live_session.hpp"
#include "gelslam/viewer/ui.hpp"

namespace gelslam::viewer::detail {

/// What happens, in large letters with a color, and below it what it means or what to do.
struct StateWords {
  std::string_view state;  ///< "background", "tracking", "no_contact", ...
  Color color = theme::kGray;
  std::string headline, advice;
};
/// The session's words ("lost: too little overlap; touch a place you have seen") as a headline and sentences.
StateWords state_words(const LiveStatus& status);
std::string sentences(
    std::string_view text);  ///< "too little; touch a place" -> "Too little. Touch a place."

std::string text_of_count(std::int64_t n);  ///< "12 345"
std::string text_of_ms(double ms);          ///< "4.2 ms", "18 ms", "1.3 s"; "-" when it is not known

}  // namespace gelslam::viewer::detail
