#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gelslam {

/// Encoding of a raw frame's bytes. bgr and yuyv are rows without gaps, with 3 and 2 bytes per pixel.
enum class FrameEncoding { jpeg, png, bgr, yuyv };

/// A frame as the sensor sent it, before decoding. This is what a log stores.
struct RawFrame {
  FrameEncoding encoding = FrameEncoding::jpeg;
  std::vector<std::uint8_t> bytes;
  /// Name for the user: "scan.avi, frame 120", "images/120.png"; "" if it has only its index.
  std::string name{};
  std::string
      damage{};  ///< Why the source has no bytes for this frame (unreadable file, error of libav), or "".
  int width_px = 0, height_px = 0;  ///< Size of the image in `bytes`.
  double time_s = 0;                ///< Time by the driver's clock since the source's first frame.
  std::int64_t unix_us = 0;         ///< Time of capture by the system's clock; 0 if not known.
  std::int64_t index = 0;           ///< Number of the frame among those that the source delivered, from 0.
  std::int64_t sequence = 0;        ///< Frame counter of the driver; a gap means frames that the driver lost.
  std::chrono::steady_clock::time_point arrived;  ///< Time at which this program received it.
  std::chrono::steady_clock::duration age{};      ///< Time from capture to arrival; 0 if not known.
  /// How often the camera was reconnected before this frame. After each time, it may have another gel.
  int reconnects = 0;
};

inline std::int64_t microseconds_of(std::chrono::nanoseconds duration) {
  return std::chrono::duration_cast<std::chrono::microseconds>(duration).count();
}

inline std::int64_t unix_us_now() {
  return microseconds_of(std::chrono::system_clock::now().time_since_epoch());
}

/// Returns the Unix time `time_s` after `start_unix_us`, or 0 if that is 0.
inline std::int64_t unix_us_of(std::int64_t start_unix_us, double time_s) {
  return start_unix_us == 0 ? 0 : start_unix_us + std::llround(1e6 * time_s);
}

/// A camera, or a log that is replayed like one. next() is called by one thread, stop() by any.
class RawFrameSource {
 public:
  virtual ~RawFrameSource() = default;
  /// Waits for the next frame. Returns nothing at the end of a log, or once stop() was called. Throws Error
  /// with a sentence for the user when the source is lost for good (unplugged, stalled, changed its format).
  /// A damaged frame is delivered as it came, and is detected by the decoder.
  virtual std::optional<RawFrame> next() = 0;
  /// Makes next() return nothing soon.
  virtual void stop() = 0;
  /// Makes next() wait while `held` is true, so that no frame is missed. Returns false for a source that
  /// cannot wait, such as a camera. May be called from any thread.
  virtual bool hold(bool /*held*/) { return false; }
  virtual double rate_hz() const = 0;  ///< As granted by the driver, or as recorded in the log.
  virtual std::optional<std::int64_t> frame_count() const { return std::nullopt; }
  /// Description for the user: "GelSight Mini R0B 28KX, /dev/video2, MJPG 3280x2464, 25 Hz". May be called
  /// from any thread.
  virtual std::string description() const = 0;
  /// Returns what the user should do while next() waits for a disconnected camera, or "". May be called from
  /// any thread.
  virtual std::string disconnect_reason() const { return ""; }
  /// Number of frames that the driver lost between the delivered ones.
  virtual std::int64_t lost_frames() const { return 0; }
  /// Problems so far as sentences for the user, or "". For a camera it may be called from any thread.
  virtual std::string warning() const { return ""; }
};

}  // namespace gelslam
