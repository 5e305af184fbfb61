#include "live/scan_folders.hpp"

#include "gelslam/core/error.hpp"

namespace gelslam::slam::detail {

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

void ScanFolders::begin_scan() {
  const std::lock_guard lock(mutex_);
  if (!runs_.empty())
    runs_.push_back(next_.empty() ? runs_.back()
                                  : LiveRun::begin(next_, false, options_.log, options_.config));
  next_.clear();
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
  if (options_.record_resized) recorder.resize_to = options_.config.sensor;
  return std::make_unique<LogRecorder>(
      std::make_unique<LogWriter>(run_->log(), *options_.record, source_.rate_hz()), recorder);
}

void LogRecording::take(const RawFrame& frame) {
  if (!recorder_) return;
  if (board_.phase() == LivePhase::background) {
    background_frames_.push_back(frame);
    if (background_frames_.size() > most_background_frames_) background_frames_.pop_front();
  }
  try {
    if (run_ != folders_.newest()) begin_next_log(frame);
  } catch (const Error& error) {  // the scan goes on without a log
    board_.warn(error.what());
    return recorder_.reset();
  }
  recorder_->push(frame);
  report();
}

/// Closes the log and begins that of the newest run, with the background just before the first frame.
void LogRecording::begin_next_log(const RawFrame& first) {
  recorder_->finish();
  report();
  run_ = folders_.newest();
  recorder_ = make_recorder();
  std::erase_if(background_frames_, [this](const RawFrame& f) { return f.index > board_.background_end(); });
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
  recorder_->finish();
  report();  // what went wrong with the last frames, too
}

}  // namespace gelslam::slam::detail
