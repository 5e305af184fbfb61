#include "live/status_text.hpp"

#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <utility>

namespace gelslam::viewer::detail {
namespace {

std::string format(const char* pattern, double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), pattern, value);
  return text.data();
}

std::string trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(' ');
  if (first == std::string_view::npos) return "";
  return std::string(text.substr(first, text.find_last_not_of(' ') - first + 1));
}

std::string capitalised(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

/// "too little overlap; touch a place" -> "Too little overlap. Touch a place."
std::string sentences(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const auto end = text.find(';');
    const std::string part = capitalised(trimmed(text.substr(0, end)));
    if (!part.empty()) {
      if (!result.empty()) result += ' ';
      result += part;
      if (part.back() != '.' && part.back() != '!' && part.back() != '?') result += '.';
    }
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
  }
  return result;
}

const char* usual_headline(LiveState state) {
  switch (state) {
    case LiveState::background:
      return "Getting ready";
    case LiveState::tracking:
      return "Tracking";
    case LiveState::no_contact:
      return "No contact";
    case LiveState::lost:
      return "Lost";
    case LiveState::paused:
      return "Paused";
    case LiveState::finishing:
      return "Finishing";
    case LiveState::finished:
      return "Finished";
  }
  return "";
}

const char* usual_advice(LiveState state) {
  switch (state) {
    case LiveState::background:
      return "Keep the gel free until its background is measured.";
    case LiveState::tracking:
      return "";
    case LiveState::no_contact:
      return "Press the object on the gel.";
    case LiveState::lost:
      return "Touch a place you have seen.";
    case LiveState::paused:
      return "Press Space to go on.";
    case LiveState::finishing:
      return "Closing loops, making the mesh, saving.";
    case LiveState::finished:
      return "Everything is saved. Look around; Q closes.";
  }
  return "";
}

}  // namespace

std::string_view name(LiveState state) {
  switch (state) {
    case LiveState::background:
      return "background";
    case LiveState::tracking:
      return "tracking";
    case LiveState::no_contact:
      return "no_contact";
    case LiveState::lost:
      return "lost";
    case LiveState::paused:
      return "paused";
    case LiveState::finishing:
      return "finishing";
    case LiveState::finished:
      return "finished";
  }
  return "";
}

LiveState live_state(const LiveStatus& status) {
  switch (status.phase) {
    case LivePhase::background:
      return LiveState::background;
    case LivePhase::paused:
      return LiveState::paused;
    case LivePhase::finishing:
      return LiveState::finishing;
    case LivePhase::finished:
      return LiveState::finished;
    case LivePhase::scanning:
      break;
  }
  switch (status.track) {
    case TrackStatus::tracked:
      return LiveState::tracking;
    case TrackStatus::lost:
      return LiveState::lost;
    case TrackStatus::background:
    case TrackStatus::no_contact:
    case TrackStatus::undone:
      break;
  }
  return LiveState::no_contact;
}

StateWords state_words(const LiveStatus& status) {
  StateWords result;
  result.state = live_state(status);
  result.headline = usual_headline(result.state);
  const std::string_view words = status.words;
  const auto colon = words.find(": ");
  if (status.phase == LivePhase::scanning) {
    const std::string_view head = words.substr(0, std::min(words.find(';'), colon));
    if (!head.empty()) result.headline = capitalised(trimmed(head));
    if (head.size() < words.size()) result.advice = sentences(words.substr(head.size() + 1));
  } else if (status.phase == LivePhase::background || status.phase == LivePhase::finishing) {
    // Here the session's words say what is being done, under a headline that stays.
    result.advice = sentences(words);
  } else if (status.phase == LivePhase::finished && !status.failure.empty()) {
    result.state = LiveState::lost;  // its color
    result.headline = "Ended with an error";
    result.advice = status.log_bytes > 0
                        ? "Not all may be saved; gelslam reconstruct makes it from the log. Q closes."
                        : "Not all may be saved. Q closes.";
  }
  if (result.advice.empty()) result.advice = usual_advice(result.state);
  return result;
}

std::string text_of_bytes(double bytes) {
  if (!(bytes >= 1)) return "0";
  if (bytes < 1e3) return format("%.0f B", bytes);
  constexpr std::array<const char*, 4> units = {"kB", "MB", "GB", "TB"};
  std::size_t unit = 0;
  double value = bytes / 1e3;
  while (value >= 999.5 && unit + 1 < units.size()) {
    value /= 1e3;
    ++unit;
  }
  return format(value < 9.995 ? "%.2f " : value < 99.95 ? "%.1f " : "%.0f ", value) + units[unit];
}

std::string text_of_duration(double s) {
  if (!std::isfinite(s) || s < 0) s = 0;
  const auto total = static_cast<long long>(s);
  std::array<char, 64> text{};
  if (total >= 3600)
    std::snprintf(text.data(), text.size(), "%lld:%02lld:%02lld", total / 3600, total / 60 % 60, total % 60);
  else
    std::snprintf(text.data(), text.size(), "%lld:%02lld", total / 60, total % 60);
  return text.data();
}

std::string text_of_count(std::int64_t n) {
  std::string digits = std::to_string(n);
  const std::size_t first = n < 0 ? 1 : 0;
  for (std::size_t i = digits.size(); i > first + 3;) digits.insert(i -= 3, " ");
  return digits;
}

std::string text_of_ms(double ms) {
  if (!std::isfinite(ms) || ms <= 0) return "-";
  if (ms < 9.95) return format("%.1f ms", ms);
  if (ms < 999.5) return format("%.0f ms", ms);
  return format("%.1f s", ms / 1e3);
}

}  // namespace gelslam::viewer::detail
