#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/sensor/sensor_profile.hpp"

namespace gelslam {

struct LogRecorderOptions {
  std::size_t max_waiting_bytes = 512u << 20;  ///< bytes of frames that are not on disk yet
  std::int64_t keep_free_bytes = 0;            ///< with less room on the disk nothing more is recorded
  /// Frames are decoded, brought to this profile's size and stored as PNG without further loss.
  std::optional<SensorProfile> resize_to;
};

struct LogRecorderStatus {
  std::int64_t written = 0, bytes = 0;
  std::int64_t damaged = 0;  ///< could not be decoded, by their source or with resize_to; not recorded
  /// no room left to wait for the disk; a gap in the sequence numbers tells where
  std::int64_t left_out = 0;
  std::size_t waiting_bytes = 0;
  bool stopped = false;  ///< the disk is full or failed: nothing more is recorded
  std::string warning;   ///< what is or was wrong, for people, or ""
};

/// A LogWriter on its own thread, so that neither camera nor tracking ever waits for the disk. Frames
/// wait in a queue that is bounded by memory only. All functions may be called from any thread.
class LogRecorder {
 public:
  LogRecorder(std::unique_ptr<LogWriter> writer, const LogRecorderOptions& options = {});
  /// finish().
  ~LogRecorder();

  /// Takes a frame and returns at once. When the queue is full the frame is left out and counted.
  void push(std::shared_ptr<const RawFrame> frame);
  /// The same for a source that can wait, such as another log: waits for room instead.
  void push_waiting(std::shared_ptr<const RawFrame> frame);
  /// Writes what waits, closes the log, and returns.
  void finish();

  LogRecorderStatus status() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
