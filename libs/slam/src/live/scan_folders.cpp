#include "live/scan_folders.hpp"

#include <utility>

#include "gelslam/core/error.hpp"

namespace gelslam {

std::filesystem::path next_run_folder(const std::filesystem::path& folder) {
  const std::filesystem::path clean = folder.has_filename() ? folder : folder.parent_path();
  for (int number = 2;; ++number) {
    std::filesystem::path next = clean;
    next += "-" + std::to_string(number);
    std::error_code code;
    if (!std::filesystem::exists(next, code)) return next;
  }
}

namespace slam::detail {

namespace fs = std::filesystem;

ScanFolders::ScanFolders(const LiveOptions& options) : options_(options) {
  if (options.run_folder.empty()) return;
  if (!options.continued) {
    runs_.push_back(LiveRun::begin(options.run_folder, options.overwrite, options.log, options.config));
    return;
  }
  runs_.push_back(LiveRun::resume(options.run_folder, options.config, options.continued->lock));
  keep_newest();
}

std::shared_ptr<LiveRun> ScanFolders::newest() const {
  const std::lock_guard lock(mutex_);
  return runs_.empty() ? nullptr : runs_.back();
}

std::shared_ptr<LiveRun> ScanFolders::of_scan(int scan) const {
  const std::lock_guard lock(mutex_);
  return runs_.empty() ? nullptr : runs_.at(static_cast<std::size_t>(scan));
}

fs::path ScanFolders::next() const {
  const std::lock_guard lock(mutex_);
  return next_;
}

std::uintmax_t ScanFolders::record_bytes() const {
  const std::shared_ptr<LiveRun> run = newest();
  std::error_code code;
  const std::uintmax_t bytes = run ? fs::file_size(run->session() / "scan.jsonl", code) : 0;
  return code ? 0 : bytes;  // not begun
}

void ScanFolders::keep_newest() {
  const std::lock_guard lock(mutex_);
  if (!runs_.empty()) next_ = next_run_folder(runs_.front()->folder());
}

void ScanFolders::ask_for_scan() {
  const std::lock_guard lock(mutex_);
  asked_ = LiveClock::now();
}

bool ScanFolders::take_back_scan() {
  const std::lock_guard lock(mutex_);
  return std::exchange(asked_, std::nullopt).has_value();
}

bool ScanFolders::awaits_scan() const {
  const std::lock_guard lock(mutex_);
  return asked_.has_value();
}

LiveClock::time_point ScanFolders::scan_begin() const {
  const std::lock_guard lock(mutex_);
  return scan_begin_;
}

bool ScanFolders::begin_scan(LiveClock::time_point arrived) {
  const std::lock_guard lock(mutex_);
  if (!asked_ || arrived <= *asked_) return false;
  asked_.reset();
  if (!runs_.empty())
    runs_.push_back(next_.empty() ? runs_.back()
                                  : LiveRun::begin(next_, false, options_.log, options_.config));
  next_.clear();
  scan_begin_ = arrived;
  return true;
}

LogRecording::LogRecording(const LiveOptions& options, const RawFrameSource& source,
                           const ScanFolders& folders, std::size_t most_waiting, LiveBoard& board)
    : options_(options),
      source_(source),
      folders_(folders),
      most_background_frames_(static_cast<std::size_t>(options.config.background_frames) + most_waiting),
      board_(board),
      run_(folders.newest()),
      recorder_(make_recorder()) {}

std::unique_ptr<LogRecorder> LogRecording::make_recorder() const {
  LogRecorderOptions recorder;
  if (options_.record_resized) recorder.resize_to = {options_.config.sensor};
  return std::make_unique<LogRecorder>(
      std::make_unique<LogWriter>(run_->log(), *options_.record, source_.rate_hz()), recorder);
}

void LogRecording::take(const RawFrame& frame, bool is_left_out) {
  if (!recorder_) return;
  if (board_.phase() == LivePhase::background) {
    background_frames_.push_back(frame);
    if (background_frames_.size() > most_background_frames_) background_frames_.pop_front();
  }
  waiting_.push_back(frame);
  // In this order: a scan that begins after these looks begins with a frame that has not been tracked yet.
  const LiveClock::time_point tracked = board_.tracked_until();
  const bool is_undecided = folders_.awaits_scan() && !is_left_out;
  try {
    if (run_ != folders_.newest()) begin_next_log();
  } catch (const Error& error) {  // the scan goes on without a log
    board_.warn(error.what());
    return recorder_.reset();
  }
  write_waiting(is_undecided ? tracked : frame.arrived);
  report();
}

void LogRecording::write_waiting(LiveClock::time_point last) {
  for (; !waiting_.empty() && waiting_.front().arrived <= last; waiting_.pop_front())
    recorder_->push(std::move(waiting_.front()));
}

/// Closes the log and begins that of the newest run, with the background just before the first frame.
void LogRecording::begin_next_log() {
  write_waiting(folders_.scan_begin() - LiveClock::duration(1));
  recorder_->finish();
  report();
  run_ = folders_.newest();
  recorder_ = make_recorder();
  std::erase_if(background_frames_, [this](const RawFrame& f) { return f.index > board_.background_end(); });
  const RawFrame& first = waiting_.front();
  auto before = static_cast<std::int64_t>(background_frames_.size());
  for (RawFrame frame : background_frames_) {
    frame.sequence = first.sequence - before;
    frame.time_s = first.time_s - static_cast<double>(before) / source_.rate_hz();
    recorder_->push(frame);
    --before;
  }
}

void LogRecording::report() {
  const LogRecorderStatus status = recorder_->status();
  board_.set_log_bytes(status.bytes);
  board_.warn_about("the log", status.warning);
}

void LogRecording::finish() {
  if (!recorder_) return;
  write_waiting(LiveClock::time_point::max());
  recorder_->finish();
  report();  // what went wrong with the last frames, too
}

}  // namespace slam::detail
}  // namespace gelslam
