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

/// One picture from the sensor, already cropped and resized to the calibrated resolution (320x240 for a
/// GelSight Mini).
struct TactileImage {
  cv::Mat3b bgr;
  double time_s = 0.0;       ///< since the log's first frame
  std::int64_t index = 0;    ///< in the log, from 0; background frames count
  std::int64_t unix_us = 0;  ///< RawFrame::unix_us, unless the profile counts from the start
};

/// Raw frames to pictures of the profile's resolution: the one way from bytes to what the gradient model
/// sees, for cameras, logs, videos and images alike, so that all give the same surface. A picture that is not
/// whole, or has no color, is left out and counted. A JPEG that is much larger than the profile is decoded at
/// 1/2 or 1/4 scale before crop and area resize (the mean difference to full decoding is below half a gray
/// level, at a third of the time). Bytes after the JPEG's end are ignored. Not thread-safe.
class FrameDecoder {
 public:
  /// Without a profile pictures keep their own size.
  explicit FrameDecoder(const std::optional<SensorProfile>& profile = std::nullopt);
  ~FrameDecoder();

  /// Nothing when the bytes are no whole picture (torn JPEG, short buffer) or have no color: damage() says
  /// what was wrong. Throws Error when the picture's size can never fit the profile.
  std::optional<TactileImage> decode(const RawFrame& frame);
  /// Says why the last decode() returned nothing: "JPEG ends early".
  const std::string& damage() const;

  std::int64_t good() const;      ///< pictures so far
  std::int64_t left_out() const;  ///< frames that were none
  /// The first of them: "frame 120: JPEG ends early"; or "".
  const std::string& first_damage() const;
  /// "left out 2 damaged pictures (the first: frame 120: JPEG ends early)", and whether pictures repeat or
  /// stand still; or "".
  std::string warning() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The pictures of a log or a camera. Streamed, never held whole.
class FrameSource {
 public:
  /// `raw` may be shared with the caller that stops it. `name` is used in messages where a frame has none.
  FrameSource(std::shared_ptr<RawFrameSource> raw, std::string name, const SensorProfile& profile);

  /// The next good picture in order, or nothing at the end; damaged ones are left out. Throws Error on a size
  /// that does not fit, and when the log begins with ten damaged pictures or holds no others.
  std::optional<TactileImage> next();
  /// Number of frames if it is known beforehand (a video's header may lie; used for progress only).
  std::optional<std::int64_t> frame_count() const { return raw_->frame_count(); }
  double rate_hz() const { return raw_->rate_hz(); }
  /// For people: "video gelsight.avi, 320x240, 25 Hz".
  std::string description() const { return raw_->description(); }
  /// Damaged pictures so far.
  std::int64_t left_out() const { return decoder_.left_out(); }
  std::int64_t lost_frames() const { return raw_->lost_frames(); }
  /// What was wrong with the frames delivered so far, as a sentence for people, or "": "video x.avi ends
  /// after 120 of 245 frames; is it truncated?". Complete once next() has returned nothing.
  std::string warning() const;

 private:
  std::shared_ptr<RawFrameSource> raw_;
  std::string name_;
  FrameDecoder decoder_;
};

/// open_raw_log() as pictures. Frames of another size than the profile's are cropped and resized as the
/// public systems do (1/7 border, aspect kept) if they have the raw size, only resized if they are larger and
/// the profile says that they are cropped, and else refused. Throws Error with what was wrong.
std::unique_ptr<FrameSource> open_frame_source(const std::filesystem::path& log,
                                               const SensorProfile& profile);

}  // namespace gelslam
