#include "gelslam/sensor/log_recorder.hpp"

#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <thread>

#include "gelslam/core/bounded_queue.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "images/sources.hpp"

namespace gelslam {

namespace fs = std::filesystem;

struct LogRecorder::Impl {
  Impl(std::unique_ptr<LogWriter> log_writer, const LogRecorderOptions& recorder_options)
      : writer(std::move(log_writer)), options(recorder_options) {
    if (options.resize_to) decoder.emplace(*options.resize_to);
    thread = std::thread([this] { run(); });
  }

  /// One frame may always wait, whatever its size.
  bool has_room(const RawFrame& frame) const {
    return queue.size() == 0 || status.waiting_bytes + frame.bytes.size() <= options.max_waiting_bytes;
  }

  void push(std::shared_ptr<const RawFrame> frame, bool may_wait) {
    std::unique_lock lock(mutex);
    if (may_wait) room.wait(lock, [&] { return status.stopped || has_room(*frame); });
    if (status.stopped) return;
    const std::size_t bytes = frame->bytes.size();
    if (!has_room(*frame))
      ++status.left_out;
    else if (queue.push_beyond_limit(std::move(frame)))
      status.waiting_bytes += bytes;
  }

  void finish() {
    std::call_once(finished, [this] {
      queue.close();
      thread.join();
    });
  }

  void run() {
    while (const auto frame = queue.pop()) {
      if (status.stopped) continue;  // Only this thread sets it.
      const std::string failure = write(**frame);
      {
        const std::lock_guard lock(mutex);
        status.waiting_bytes -= (*frame)->bytes.size();
        status.written = writer->frames();
        status.bytes = writer->bytes();
        if (!failure.empty()) give_up(failure);
      }
      room.notify_all();
    }
    writer->close();
    const std::lock_guard lock(mutex);
    status.bytes = writer->bytes();
    if (!writer->failure().empty()) give_up(writer->failure());
  }

  /// Returns "" or why nothing more can be recorded.
  std::string write(const RawFrame& frame) {
    try {
      if (options.keep_free_bytes > 0 && free_bytes() < options.keep_free_bytes)
        return writer->path().string() + ": recording stopped after " + counted(writer->frames(), "frame") +
               ", still readable: less than " + bytes_text(options.keep_free_bytes) + " is free on the disk";
      if (!decoder && frame.damage.empty()) return writer->write(frame) ? "" : writer->failure();
      const std::optional<RawFrame> small = resized(frame);
      return !small || writer->write(*small) ? "" : writer->failure();
    } catch (const std::exception& error) {
      // For example an image of a wrong size, or lack of memory; the scan must go on.
      return writer->path().string() + ": recording stopped: " + error.what();
    }
  }

  std::int64_t free_bytes() const {
    std::error_code code;
    const fs::space_info space = fs::space(writer->path(), code);
    return code ? INT64_MAX : static_cast<std::int64_t>(space.available);
  }

  std::optional<RawFrame> resized(const RawFrame& frame) {
    const std::optional<TactileImage> image = decoder ? decoder->decode(frame) : std::nullopt;
    if (!image) {
      const std::lock_guard lock(mutex);
      ++status.damaged;
      return std::nullopt;
    }
    RawFrame small;
    small.time_s = frame.time_s;
    small.unix_us = frame.unix_us;
    small.index = frame.index;
    small.sequence = frame.sequence;
    detail::put_picture(image->bgr, small);
    return small;
  }

  void give_up(const std::string& failure) {
    status.stopped = true;
    status.warning = failure;
    status.waiting_bytes = 0;
  }

  LogRecorderStatus current() const {
    const std::lock_guard lock(mutex);
    LogRecorderStatus now = status;
    if (now.stopped) return now;
    if (now.left_out > 0)
      now.warning = "the disk is too slow: " + counted(now.left_out, "frame") + " could not be recorded";
    else if (now.waiting_bytes > options.max_waiting_bytes / 4)
      now.warning = "the disk is slow: " + std::to_string(now.waiting_bytes >> 20) + " MB wait to be written";
    return now;
  }

  std::unique_ptr<LogWriter> writer;
  LogRecorderOptions options;
  std::optional<FrameDecoder> decoder;  // Set if frames are to be resized.
  mutable std::mutex mutex;
  std::condition_variable room;
  BoundedQueue<std::shared_ptr<const RawFrame>> queue{SIZE_MAX};  // Limited by bytes, in push().
  LogRecorderStatus status;
  std::once_flag finished;
  std::thread thread;
};

LogRecorder::LogRecorder(std::unique_ptr<LogWriter> writer, const LogRecorderOptions& options)
    : impl_(std::make_unique<Impl>(std::move(writer), options)) {}
LogRecorder::~LogRecorder() { finish(); }

void LogRecorder::push(std::shared_ptr<const RawFrame> frame) { impl_->push(std::move(frame), false); }
void LogRecorder::push_waiting(std::shared_ptr<const RawFrame> frame) { impl_->push(std::move(frame), true); }
void LogRecorder::finish() { impl_->finish(); }
LogRecorderStatus LogRecorder::status() const { return impl_->current(); }

}  // namespace gelslam
