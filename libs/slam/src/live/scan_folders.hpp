#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <vector>

#include "gelslam/sensor/log_recorder.hpp"
#include "gelslam/slam/live_slam.hpp"
#include "live/live_board.hpp"
#include "run_folder/live_run.hpp"

namespace gelslam::slam::detail {

/// The run folders of a live session, scan by scan. Scans share a folder until something is saved in it: the
/// next one then gets RUN-2, RUN-3, ... Thread-safe. Without LiveOptions::run_folder there are none.
class ScanFolders {
 public:
  /// Makes, or takes over, the folder of the first scan. Throws Error like LiveRun.
  explicit ScanFolders(const LiveOptions& options);

  std::shared_ptr<LiveRun> newest() const;           ///< null: there are none
  std::shared_ptr<LiveRun> of_scan(int scan) const;  ///< null: there are none
  /// Of a new scan, if that does not share the folder; or empty.
  std::filesystem::path next() const;
  /// Size of the newest run's record. What it holds now will be in every map that is asked for from now on.
  std::uintmax_t record_bytes() const;

  void keep_newest();  ///< the present scan is being saved
  void begin_scan();   ///< throws Error when its folder cannot be made

 private:
  const LiveOptions& options_;
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<LiveRun>> runs_;
  std::filesystem::path next_;
};

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
