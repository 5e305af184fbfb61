#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gelslam {

/// How a raw frame's bytes are to be read. bgr and yuyv are rows without gaps, 3 and 2 bytes per pixel.
enum class FrameEncoding { jpeg, png, bgr, yuyv };

/// One frame as the sensor sent it, before anything is decoded: what a log keeps.
struct RawFrame {
  FrameEncoding encoding = FrameEncoding::jpeg;
  std::vector<std::uint8_t> bytes;
  std::string name{};  ///< for people: "scan.avi, frame 120", "images/120.png"; "": it has only its index
  std::string
      damage{};  ///< why the source has no bytes for this frame (unreadable file, error of libav), or ""
  int width_px = 0, height_px = 0;  ///< of the picture in `bytes`
  double time_s = 0;                ///< by the driver's clock, since the source's first frame
  std::int64_t unix_us = 0;         ///< when it was captured, by the system's clock; 0: not known
  std::int64_t index = 0;           ///< of the frames that the source delivered, from 0
  std::int64_t sequence = 0;        ///< the driver's count; a gap is a frame that the driver lost
  std::chrono::steady_clock::time_point arrived;  ///< when this program got it
  std::chrono::steady_clock::duration age{};      ///< since its capture, when it arrived; 0: not known
  /// How often the camera came back before: since the last time the gel may be another one's.
  int reconnects = 0;
};

inline std::int64_t microseconds_of(std::chrono::nanoseconds duration) {
  return std::chrono::duration_cast<std::chrono::microseconds>(duration).count();
}

inline std::int64_t unix_us_now() {
  return microseconds_of(std::chrono::system_clock::now().time_since_epoch());
}

/// `time_s` after `start_unix_us`; 0 where that is 0.
inline std::int64_t unix_us_of(std::int64_t start_unix_us, double time_s) {
  return start_unix_us == 0 ? 0 : start_unix_us + std::llround(1e6 * time_s);
}

/// A camera, or a log that is played like one. next() is called from one thread, stop() from any.
class RawFrameSource {
 public:
  virtual ~RawFrameSource() = default;
  /// Waits for the next frame; nothing at the end of a log, or once stop() was called. Throws Error with a
  /// sentence for people when the source is lost for good (unplugged, stalled, changed its format). A frame
  /// that came damaged is delivered as it came: the decoder says so.
  virtual std::optional<RawFrame> next() = 0;
  /// Makes next() return soon, with nothing.
  virtual void stop() = 0;
  /// Lets next() wait while `held`, so that nothing is missed. False for what cannot wait, as a camera. From
  /// any thread.
  virtual bool hold(bool /*held*/) { return false; }
  virtual double rate_hz() const = 0;  ///< as granted by the driver, or as the log says
  virtual std::optional<std::int64_t> frame_count() const { return std::nullopt; }
  /// For people: "GelSight Mini R0B 28KX, /dev/video2, MJPG 3280x2464, 25 Hz". From any thread.
  virtual std::string description() const = 0;
  /// What people are to do where next() waits for a camera that is away, or "". From any thread.
  virtual std::string disconnect_reason() const { return ""; }
  /// Frames that the driver lost between the ones delivered.
  virtual std::int64_t lost_frames() const { return 0; }
  /// What was wrong so far, as sentences for people, or "". Of a camera from any thread.
  virtual std::string warning() const { return ""; }
};

}  // namespace gelslam
