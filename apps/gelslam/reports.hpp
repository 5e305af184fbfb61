#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "gelslam/sensor/log_recorder.hpp"
#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/slam/reconstruct.hpp"

namespace gelslam {

/// "120 frames in the map; 1 trial in 1 piece, 6 keyframes, 1 loop".
std::string map_words(const RunReport& report);
/// "mesh of 12146 vertices and 23394 triangles".
std::string mesh_words(const RunReport::MeshSize& mesh);

/// What `reconstruct` and `fuse` say at the end, with a line for each part of the scan; when quiet only
/// warnings.
std::string run_words(const RunReport& report, const std::string& run_folder, bool quiet);

/// A line "warning: 1 piece not joined; ..." for each.
std::string warning_words(const std::vector<std::string>& warnings);

/// On stderr, those of a run.
void say_reservations(const std::filesystem::path& run_folder);

/// A line "warning: ..." on stderr; nothing for "".
void warn(const std::string& warning);

/// What a recording says to the person at the terminal, on stderr.
class RecordReport {
 public:
  RecordReport(const std::string& log, bool quiet, const RawFrameSource& source);

  void start();
  /// A sentence of its own line, also when quiet.
  void say(const std::string& sentence);
  /// For every frame; draws the progress line now and then, and says warnings that are new.
  void count(const RawFrame& frame, const LogRecorderStatus& status);
  void finish(const LogRecorderStatus& status);
  bool good() const { return good_; }

 private:
  void clear_line();
  double rate_hz() const;

  const RawFrameSource& source_;
  std::string log_;
  bool quiet_, terminal_, good_ = true, drawn_ = false;
  std::string said_;  // the first warning
  std::int64_t frames_ = 0;
  double first_s_ = 0, last_s_ = 0;
  std::chrono::steady_clock::time_point drawn_at_;
};

/// Looks at a recording's first frames, which should show the bare gel, and says what makes it doubt them:
/// while the person can still begin again.
class StartCheck {
 public:
  StartCheck(const Config& config, std::function<void(const std::string&)> say_doubt);
  /// Every frame in order; does nothing after the first few.
  void look_at(const RawFrame& frame);

 private:
  void judge();

  Config config_;
  ColorGain color_gain_;
  std::function<void(const std::string&)> say_doubt_;
  std::optional<FrameDecoder> decoder_;  ///< gone once all is said
  std::vector<cv::Mat3b> pictures_;
};

}  // namespace gelslam
