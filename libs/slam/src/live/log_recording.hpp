#pragma once

#include <deque>
#include <memory>

#include "gelslam/sensor/log_recorder.hpp"
#include "live/live_board.hpp"
#include "live/scan_folders.hpp"

namespace gelslam::slam::detail {

/// Records what the camera sends, a log in each run folder. Of the capture thread. A full disk ends the log,
/// not the scan.
class LogRecording {
 public:
  /// `most_waiting`: frames that arrive before it is known that the background is complete. Throws Error when
  /// the first log cannot be written.
  LogRecording(const LiveOptions& options, const RawFrameSource& source, const ScanFolders& folders,
               std::size_t most_waiting, LiveBoard& board);

  void take(const RawFrame& frame);
  void finish();

 private:
  std::unique_ptr<LogRecorder> make_recorder() const;
  void begin_next_log(const RawFrame& first);
  void report();

  const LiveOptions& options_;
  const RawFrameSource& source_;
  const ScanFolders& folders_;
  const std::size_t most_background_frames_;
  LiveBoard& board_;
  std::shared_ptr<LiveRun> run_;            // whose log it is
  std::unique_ptr<LogRecorder> recorder_;   // none after a failure
  std::deque<RawFrame> background_frames_;  // another log begins with them, so that it can be replayed alone
};

}  // namespace gelslam::slam::detail
