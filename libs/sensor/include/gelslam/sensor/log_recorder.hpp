#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/sensor/sensor_profile.hpp"

namespace gelslam {

struct LogRecorderOptions {
  std::size_t max_waiting_bytes = 512u << 20;  ///< bytes of frames that are not on disk yet
  /// One for each track: frames are decoded, brought to this profile's size and stored as PNG without further
  /// loss.
  std::vector<SensorProfile> resize_to;
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
  void push(std::shared_ptr<const RawFrame> frame, std::size_t track = 0);
  /// The same for a source that can wait, such as another log: waits for room instead.
  void push_waiting(std::shared_ptr<const RawFrame> frame, std::size_t track = 0);
  /// Writes what waits, closes the log, and returns.
  void finish();

  LogRecorderStatus status() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct RecordSensors {
  bool can_wait = false;  ///< the sources are logs: none of their frames is left out
  /// Sees each frame before it is recorded; false ends its sensor. Called from a thread of each sensor.
  std::function<bool(std::size_t sensor, const RawFrame& frame)> look;
  /// Why a sensor failed while another goes on.
  std::function<void(const std::string& why)> lost;
};

/// Records a source into each track until all have ended: logs in the order of their times, cameras as their
/// frames come, so that none waits for another. Throws what the last one failed by.
void record_sensors(const std::vector<RawFrameSource*>& sources, LogRecorder& recorder,
                    const RecordSensors& options);

/// Lets the times of two cameras count from one start, by this machine's clock: their own count from their
/// first frames. The first frames of each are left out, for the driver may have kept them since long ago.
/// Each may be read from a thread of its own.
void put_on_one_clock(std::unique_ptr<RawFrameSource>& first, std::unique_ptr<RawFrameSource>& second);

}  // namespace gelslam
