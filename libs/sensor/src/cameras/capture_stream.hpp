#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "cameras/video_node.hpp"

namespace gelslam::detail {

/// A frame as it came out of the driver's queue.
struct CapturedFrame {
  std::vector<std::uint8_t> bytes;
  std::uint32_t sequence = 0;
  /// By the driver, of the monotonic clock; nothing where it has another one.
  std::optional<std::chrono::steady_clock::time_point> captured;
  std::chrono::steady_clock::time_point arrived;
};

enum class Capture { frame, nothing_yet, damaged };

/// The driver's buffers, mapped and streaming while this lives.
class CaptureStream {
 public:
  /// Throws Error when the driver gives no buffers or does not start.
  explicit CaptureStream(const VideoNode& node);
  ~CaptureStream();
  CaptureStream(const CaptureStream&) = delete;
  CaptureStream& operator=(const CaptureStream&) = delete;

  /// Waits up to `wait_ms`. Damaged: marked so by the driver, or empty. Throws CameraFailure when the camera
  /// is gone.
  Capture take(int wait_ms, CapturedFrame& frame);

 private:
  void map_buffers();
  void unmap_buffers();
  void queue(std::uint32_t index);

  const VideoNode& node_;
  std::vector<std::span<std::uint8_t>> buffers_;
};

}  // namespace gelslam::detail
