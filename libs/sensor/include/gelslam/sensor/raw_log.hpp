#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/sensor/sensor_profile.hpp"

namespace gelslam {

/// Contents of a log besides its images, so that it can be reconstructed without other files. Any may be
/// empty.
struct LogAttachments {
  std::string sensor;           ///< RawFrameSource::description() of the camera
  std::string camera_settings;  ///< one "name value" per line
  std::string config_yaml;      ///< the configuration file's text
  std::string model;            ///< the bytes of nnmodel.pth
};

/// Writes a growing Matroska file with the sensor's own bytes (docs/cameras-and-logs.md): jpeg, png and yuyv
/// are stored unchanged, bgr is stored as PNG without loss. Times are stored to the microsecond, and each
/// frame has its sequence number. When write() returns, the frame has been passed to the operating system, so
/// that kill -9 of this program loses nothing. A power failure may lose the last half minute, because nothing
/// is forced to the disk before close(). To be used by one thread.
class LogWriter {
 public:
  /// Creates the file; its header is written with the first frame. Throws Error when the file exists or
  /// cannot be created, and when an attachment is larger than readers accept.
  LogWriter(const std::filesystem::path& path, const LogAttachments& attachments, double rate_hz);
  /// Calls close().
  ~LogWriter();
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  /// Appends a frame. Returns false once the disk is full or has failed, or when a frame differs in kind or
  /// size from the first one. Nothing more is written from then on, the file remains readable, and failure()
  /// says why. Does not throw for such problems, so that a scan goes on.
  bool write(const RawFrame& frame);
  /// Reason as a sentence for the user, or "".
  const std::string& failure() const;

  /// Writes the number of frames and the duration into the header. A log without frames is removed. write()
  /// must not be called afterwards.
  void close();

  const std::filesystem::path& path() const;
  std::int64_t frames() const;  ///< Number of frames written.
  std::int64_t bytes() const;   ///< Size of the file.

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Opens a log as a source of raw frames: a video, a folder of images (sorted naturally by name), a run
/// folder (log.mkv) or a data folder (gelsight.avi). The bytes of JPEG and PNG files and of videos of JPEG,
/// PNG or YUYV images are delivered unchanged; other videos and images are decoded to bgr at their own size.
/// Times and sequence numbers are those that were recorded, but a time that is not after the previous one, or
/// that most of the next three contradict, is replaced by one at most a frame after the previous one;
/// warning() counts these. Images have the times in their names, else those of the profile's rate. From a
/// video that was truncated or not closed, the complete frames are delivered, and warning() says so. Throws
/// Error for anything else.
std::unique_ptr<RawFrameSource> open_raw_log(const std::filesystem::path& log,
                                             const SensorProfile& profile = {});

/// Says whether the file begins like a Matroska file, whatever its name. False if it cannot be read.
bool is_matroska(const std::filesystem::path& file);

/// Reads the attachments of a Matroska log; missing ones are empty. Throws Error when the file is no Matroska
/// file, or an attachment is implausibly large (configuration 1 MiB, model 4 MiB).
LogAttachments read_log_attachments(const std::filesystem::path& log);

enum class Pace { as_recorded, as_taken };

/// Replays a source at the times at which it was recorded (steady clock; the first frame immediately), or as
/// fast as frames are requested. A frame that is requested too late is delivered immediately, as is a frame
/// after a gap of more than 30 s, whose time must be damaged; no frame is left out. hold() stops the clock;
/// stop() wakes a waiting next().
std::unique_ptr<RawFrameSource> pace(std::unique_ptr<RawFrameSource> source, Pace pace = Pace::as_recorded);

}  // namespace gelslam
