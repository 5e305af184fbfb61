#include "live/log_recording.hpp"

#include "gelslam/core/error.hpp"

namespace gelslam::slam::detail {

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
