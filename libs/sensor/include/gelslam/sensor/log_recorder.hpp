#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/sensor/sensor_profile.hpp"

namespace gelslam {

struct LogRecorderOptions {
  std::size_t max_waiting_bytes = 512u << 20;  ///< Frames that are not on the disk yet.
  std::int64_t keep_free_bytes = 0;  ///< Recording stops when less space than this is left on the disk.
  /// If set, frames are decoded, brought to this profile's size and stored losslessly as PNG.
  std::optional<SensorProfile> resize_to;
};

struct LogRecorderStatus {
  std::int64_t written = 0, bytes = 0;
  /// Frames that could not be decoded, by their source or with resize_to; they are not recorded.
  std::int64_t damaged = 0;
  /// Frames that were left out because the queue was full; a gap in the sequence numbers shows where.
  std::int64_t left_out = 0;
  std::size_t waiting_bytes = 0;
  bool stopped = false;  ///< The disk is full or has failed; nothing more is recorded.
  std::string warning;   ///< Current or past problem as a sentence for the user, or "".
};

/// Runs a LogWriter on its own thread, so that neither camera nor tracking waits for the disk. Frames wait in
/// a queue that is limited by memory only. All functions may be called from any thread.
class LogRecorder {
 public:
  LogRecorder(std::unique_ptr<LogWriter> writer, const LogRecorderOptions& options = {});
  /// Calls finish().
  ~LogRecorder();

  /// Takes a frame and returns immediately. If the queue is full, the frame is left out and counted.
  void push(std::shared_ptr<const RawFrame> frame);
  /// As push(), for a source that can wait, such as another log: waits until there is room.
  void push_waiting(std::shared_ptr<const RawFrame> frame);
  /// Writes all waiting frames and closes the log.
  void finish();

  LogRecorderStatus status() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
