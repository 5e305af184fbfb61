#pragma once

#include <cstdint>
#include <string>

#include "gelslam/slam/live_session.hpp"

namespace gelslam::viewer::detail {

/// What the banner's color says.
enum class LiveState { background, tracking, no_contact, lost, paused, finishing, finished };

/// "background", "tracking", "no_contact", ...: as a script's `until` names them.
std::string_view name(LiveState state);
LiveState live_state(const LiveStatus& status);

/// The state in large letters, and below it what it means or what to do.
struct StateWords {
  LiveState state = LiveState::background;
  std::string headline;
  std::string advice;
};
/// The session's words ("lost: too little overlap; touch a place you have seen") as a headline and sentences.
StateWords state_words(const LiveStatus& status);

std::string text_of_bytes(double bytes);    ///< "0", "812 kB", "1.24 GB"
std::string text_of_duration(double s);     ///< "0:07", "12:30", "1:02:03"
std::string text_of_count(std::int64_t n);  ///< "12 345"
std::string text_of_ms(double ms);          ///< "4.2 ms", "18 ms", "1.3 s"; "-" when it is not known

}  // namespace gelslam::viewer::detail
