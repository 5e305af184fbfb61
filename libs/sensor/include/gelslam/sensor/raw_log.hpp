#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/sensor/sensor_profile.hpp"

namespace gelslam {

/// What a log holds beside its pictures, so that it can be reconstructed on its own. Any may be empty.
struct LogAttachments {
  std::string sensor;           ///< RawFrameSource::description() of the camera
  std::string camera_settings;  ///< one "name value" per line
  std::string config_yaml;      ///< the configuration file's text
  std::string model;            ///< the bytes of nnmodel.pth
};

/// A growing Matroska file with the sensor's own bytes (docs/cameras-and-logs.md): jpeg, png and yuyv are
/// kept as they came, bgr becomes PNG without loss. Times are kept to the microsecond, sequence numbers
/// beside each frame. Every frame is given to the system when write() returns, so that kill -9 of this
/// program loses nothing; a power cut may lose the last half minute, for nothing is forced to the disk before
/// close(). One thread.
class LogWriter {
 public:
  /// Creates the file; its header is written with the first frame. Throws Error when the file exists or
  /// cannot be made, and when an attachment is larger than a reader accepts.
  LogWriter(const std::filesystem::path& path, const LogAttachments& attachments, double rate_hz);
  /// close().
  ~LogWriter();
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  /// Appends a frame. False once the disk is full (or fails), or when a frame is not of the first one's
  /// kind and size: nothing more is written from then on, what was written stays readable, failure() says
  /// why. Never throws for the disk's sake, so that a scan goes on.
  bool write(const RawFrame& frame);
  /// As a sentence for people, or "".
  const std::string& failure() const;

  /// Notes number of frames and duration in the header. A log without a frame is removed. Write no more after
  /// it.
  void close();

  const std::filesystem::path& path() const;
  std::int64_t frames() const;  ///< written
  std::int64_t bytes() const;   ///< of the file

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Opens a log as a source of raw frames: a video, a folder of images (sorted naturally by name), a run
/// folder (log.mkv) or a data folder (gelsight.avi). Videos of JPEG, PNG or YUYV pictures and JPEG and PNG
/// files give their bytes; other videos and images are decoded, and come as bgr at their own size. Times and
/// sequence numbers are those that were recorded (a time that is not after the last one, or that most of the
/// next three contradict: up to one frame after the last; warning() counts them);
/// images have their names' times, else the profile's rate. A video that was cut off or never closed gives
/// what is whole, and warning() says so. Throws Error when it is none of these.
std::unique_ptr<RawFrameSource> open_raw_log(const std::filesystem::path& log,
                                             const SensorProfile& profile = {});

/// True when the file begins as Matroska does, whatever its name. False when it cannot be read.
bool is_matroska(const std::filesystem::path& file);

/// What a Matroska log holds of its sensor beside its pictures; what it lacks stays empty. Throws Error when
/// the file is no Matroska file, or an attachment is too large to be what its name says (configuration 1 MiB,
/// model 4 MiB).
LogAttachments read_log_attachments(const std::filesystem::path& log);

enum class Pace { as_recorded, as_taken };

/// Plays a source at the times it was recorded (steady clock; the first frame at once), or as fast as frames
/// are taken. A frame that is asked for too late is delivered at once, and so is one after a gap of more than
/// 30 s, whose time can only be damaged; none is left out. hold() stops the clock; stop() wakes a waiting
/// next().
std::unique_ptr<RawFrameSource> pace(std::unique_ptr<RawFrameSource> source, Pace pace = Pace::as_recorded);

}  // namespace gelslam
