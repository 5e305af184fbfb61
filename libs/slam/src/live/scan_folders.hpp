#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
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

  void ask_for_scan();                       ///< that begins with the next touch
  bool take_back_scan();                     ///< false: none is awaited (any more)
  bool awaits_scan() const;                  ///< one was asked for, and has not begun
  LiveClock::time_point scan_begin() const;  ///< when the newest scan's first frame arrived
  /// The frame that arrived then touches: the scan that was asked for before begins with it. False: none was.
  /// Throws Error when its folder cannot be made; the scan is then not awaited any more.
  bool begin_scan(LiveClock::time_point arrived);

 private:
  const LiveOptions& options_;
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<LiveRun>> runs_;
  std::filesystem::path next_;
  std::optional<LiveClock::time_point> asked_;  // for a scan that has not begun
  LiveClock::time_point scan_begin_;
};

/// Records what the camera sends, a log in each run folder. Of the capture thread. A full disk ends the log,
/// not the scan. While a new scan is awaited, frames wait until the tracker has seen them: whose they are is
/// not known before.
class LogRecording {
 public:
  /// `most_waiting`: frames that arrive before it is known that the background is complete. Throws Error when
  /// the first log cannot be written.
  LogRecording(const LiveOptions& options, const RawFrameSource& source, const ScanFolders& folders,
               std::size_t most_waiting, LiveBoard& board);

  void take(const RawFrame& frame, bool is_left_out);  ///< left out: the tracker will not see it
  void finish();

 private:
  std::unique_ptr<LogRecorder> make_recorder() const;
  void begin_next_log();
  void write_waiting(LiveClock::time_point last);
  void report();

  const LiveOptions& options_;
  const RawFrameSource& source_;
  const ScanFolders& folders_;
  const std::size_t most_background_frames_;
  LiveBoard& board_;
  std::shared_ptr<LiveRun> run_;           // whose log it is
  std::unique_ptr<LogRecorder> recorder_;  // none after a failure
  std::deque<RawFrame> waiting_;
  std::deque<RawFrame> background_frames_;  // another log begins with them, so that it can be replayed alone
};

}  // namespace gelslam::slam::detail
