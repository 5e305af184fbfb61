#include "gelslam/slam/status_text.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <utility>

#include "gelslam/core/text.hpp"

namespace gelslam {
namespace {

std::string capitalized(std::string text) {
  if (!text.empty() && !text.starts_with("gelslam"))
    text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

StateWords usual_words(const LiveStatus& status) {
  if (status.phase == LivePhase::background)
    return {"background", Tone::blue, "Getting ready", "Keep the gel free until its background is measured."};
  if (status.phase == LivePhase::paused) return {"paused", Tone::gray, "Paused", ""};
  if (status.phase == LivePhase::finishing)
    return {"finishing", Tone::blue, "Finishing", "Closing loops, fusing, saving."};
  if (status.phase == LivePhase::finished)
    return {"finished", Tone::green, "Finished",
            !status.run_folder.empty() ? "Everything is saved."
            : status.is_scan           ? "Nothing is kept (no -o)."
                                       : ""};
  if (status.track == TrackStatus::tracked) return {"tracking", Tone::green, "Tracking", ""};
  if (status.track == TrackStatus::lost) return {"lost", Tone::red, "Lost", "Touch a place you have seen."};
  return {"no_contact", Tone::amber, "No contact",
          status.keyframes == 0 ? "Press the object on the gel."
                                : "Press the object on the gel, at a place you have seen."};
}

void say_while_scanning(const LiveStatus& status, StateWords& words) {
  if (!status.state.empty()) words.headline = capitalized(status.state);
  if (std::string said = sentences(status.reason + ";" + status.advice); !said.empty()) words.advice = said;
  if (words.state == "tracking" && !status.reason.empty())
    words = {words.state, Tone::amber, "Position uncertain", words.advice};
}

/// Returns what the user at the window can do next, to be appended to the advice.
std::string key_hint(const LiveStatus& status, const StateWords& words) {
  if (status.phase == LivePhase::paused) return "Press Space to go on.";
  if (status.phase != LivePhase::finished) return "";
  return words.tone == Tone::green ? " Look around; Q closes." : " Q closes.";
}

Figure loss(const char* label, std::int64_t count) {
  return {label, text_of_count(count), count > 0 ? Tone::amber : Tone::gray};
}

}  // namespace

std::string sentences(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const auto end = text.find(';');
    const std::string part = capitalized(trimmed(text.substr(0, end)));
    if (!part.empty()) {
      if (!result.empty()) result += ' ';
      result += part;
      if (part.back() != '.' && part.back() != '!' && part.back() != '?') result += '.';
    }
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
  }
  return result;
}

StateWords state_words(const LiveStatus& status, bool keys) {
  StateWords words = usual_words(status);
  if (status.phase == LivePhase::scanning) {
    say_while_scanning(status, words);
  } else if (status.phase == LivePhase::background || status.phase == LivePhase::finishing) {
    const std::string progress = status.progress.empty() ? "" : ": " + status.progress;
    if (std::string said = sentences(state_line(status) + progress); !said.empty())
      words.advice = std::move(said);
  } else if (status.phase == LivePhase::finished && !status.failure.empty()) {
    words.tone = Tone::red;
    words.headline = "Ended with an error";
    words.advice = status.log_bytes > 0 ? "Not all may be saved; gelslam reconstruct makes it from the log."
                                        : "Not all may be saved.";
  } else if (status.phase == LivePhase::finished) {
    if (!status.result_warnings.empty()) {
      words.tone = Tone::amber;
      if (!status.run_folder.empty()) words.advice = "Saved.";
    }
    if (!status.touched.empty()) words.advice += " " + sentences(status.touched);
    for (const std::string& warning : status.result_warnings) words.advice += " " + sentences(warning);
  }
  if (keys) words.advice += key_hint(status, words);
  return words;
}

std::string state_line(const LiveStatus& status) {
  return status.state + (status.reason.empty() ? "" : ": " + status.reason) +
         (status.advice.empty() ? "" : "; " + status.advice);
}

std::vector<Figure> usual_figures(const LiveStatus& s) {
  return {{"Rate", s.rate_hz > 0 ? fmt::format("{:.1f} Hz", s.rate_hz) : "-"},
          {"Latency", text_of_ms(s.latency_ms)},
          {"Components", text_of_count(s.components), s.components > 1 ? Tone::amber : Tone::gray},
          loss("Dropped", s.dropped)};
}

std::vector<Figure> further_figures(const LiveStatus& s) {
  return {{"Keyframes", text_of_count(s.keyframes)},
          {"Loops", text_of_count(s.loops)},
          {"Trials", text_of_count(s.trials)},
          loss("Camera lost", s.lost_by_camera),
          loss("Damaged", s.damaged),
          {"Memory", bytes_text(std::llround(s.memory_mb * 1e6))},
          {"Log", s.log_bytes > 0 ? bytes_text(s.log_bytes) : "none"}};
}

std::string refusal(ScanCommand command, const LiveStatus& status, bool another) {
  const bool over = status.phase == LivePhase::finishing || status.phase == LivePhase::finished;
  if (command == ScanCommand::new_scan && !status.is_scan) return "This is no scan: it can be stopped only.";
  if (command == ScanCommand::new_scan) return another ? "" : "There is no camera for another scan.";
  return over ? "The scan is over." : "";
}

std::string text_of_count(std::int64_t n) {
  std::string digits = std::to_string(n);
  const std::size_t first = n < 0 ? 1 : 0;
  for (std::size_t i = digits.size(); i > first + 3;) digits.insert(i -= 3, " ");
  return digits;
}

std::string text_of_ms(double ms) {
  if (!std::isfinite(ms) || ms <= 0) return "-";
  if (ms < 9.95) return fmt::format("{:.1f} ms", ms);
  if (ms < 999.5) return fmt::format("{:.0f} ms", ms);
  return fmt::format("{:.1f} s", ms / 1e3);
}

}  // namespace gelslam
