#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/sensor/sensor_profile.hpp"

namespace gelslam {

/// An image of the sensor, already cropped and resized to the calibrated resolution (320x240 for a GelSight
/// Mini).
struct TactileImage {
  cv::Mat3b bgr;
  double time_s = 0.0;       ///< Time since the log's first frame.
  std::int64_t index = 0;    ///< Index in the log, from 0; background frames count.
  std::int64_t unix_us = 0;  ///< RawFrame::unix_us, unless the profile counts from the start
};

/// Decodes raw frames to images of the profile's resolution. Cameras, logs, videos and images all use this
/// class, so that the gradient model sees the same pixels. An image that is incomplete or has no color is
/// left out and counted. A JPEG much larger than the profile is decoded at 1/2 or 1/4 scale before it is
/// cropped and resized by area (the mean difference to full decoding is below half a gray level, in a third
/// of the time). Bytes after the end of a JPEG are ignored. Not thread-safe.
class FrameDecoder {
 public:
  /// Without a profile, images keep their own size.
  explicit FrameDecoder(const std::optional<SensorProfile>& profile = std::nullopt);
  ~FrameDecoder();

  /// Returns nothing if the bytes are not a complete color image (torn JPEG, short buffer); damage() then
  /// says why. Throws Error when the image's size can never fit the profile.
  std::optional<TactileImage> decode(const RawFrame& frame);
  /// Returns why the last decode() returned nothing: "JPEG ends early".
  const std::string& damage() const;

  std::int64_t good() const;      ///< Returns the number of decoded images.
  std::int64_t left_out() const;  ///< Returns the number of frames that could not be decoded.
  /// Describes the first of them: "frame 120: JPEG ends early"; or "".
  const std::string& first_damage() const;
  /// Returns "left out 2 damaged pictures (the first: frame 120: JPEG ends early)", and a warning if images
  /// repeat or do not change at all; or "".
  std::string warning() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The images of a log or a camera. They are streamed, and never held in memory all at once.
class FrameSource {
 public:
  /// `raw` may be shared with a caller that stops it. `name` is used in messages about frames without a name.
  FrameSource(std::shared_ptr<RawFrameSource> raw, std::string name, const SensorProfile& profile);

  /// Returns the next good image in order, or nothing at the end; damaged ones are left out. Throws Error for
  /// a size that does not fit the profile, and when the log begins with ten damaged images or contains no
  /// others.
  std::optional<TactileImage> next();
  /// Number of frames if it is known in advance (a video's header may be wrong; for progress only).
  std::optional<std::int64_t> frame_count() const { return raw_->frame_count(); }
  double rate_hz() const { return raw_->rate_hz(); }
  /// Description for the user: "video gelsight.avi, 320x240, 25 Hz".
  std::string description() const { return raw_->description(); }
  /// Number of damaged images so far.
  std::int64_t left_out() const { return decoder_.left_out(); }
  std::int64_t lost_frames() const { return raw_->lost_frames(); }
  /// Problems of the frames delivered so far as a sentence for the user, or "": "video x.avi ends after 120
  /// of 245 frames; is it truncated?". Complete when next() has returned nothing.
  std::string warning() const;

 private:
  std::shared_ptr<RawFrameSource> raw_;
  std::string name_;
  FrameDecoder decoder_;
};

/// Opens a log as a source of images (see open_raw_log()). Frames that do not have the profile's size are
/// cropped and resized as in the public systems (1/7 border, aspect kept) if they have the raw size, only
/// resized if they are larger and the profile says that they are cropped, and refused otherwise. Throws Error
/// with the reason.
std::unique_ptr<FrameSource> open_frame_source(const std::filesystem::path& log,
                                               const SensorProfile& profile);

}  // namespace gelslam
