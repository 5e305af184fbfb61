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
  double time_s = 0.0;     ///< since the log's first frame
  std::int64_t index = 0;  ///< in the log, from 0; background frames count
};

/// Where pictures come from: a video, a folder of images, later a camera. Streamed, never held whole.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// The next frame in order, or nothing at the end. Throws Error on a damaged frame or a size that does not
  /// fit.
  virtual std::optional<TactileImage> next() = 0;
  /// Number of frames if it is known beforehand (a video's header may lie; used for progress only).
  virtual std::optional<std::int64_t> frame_count() const = 0;
  virtual double rate_hz() const = 0;
  /// For people: "video gelsight.avi, 320x240, 25 Hz".
  virtual std::string description() const = 0;
  /// What was not right with the frames delivered so far, as a sentence for people, or "": "video x.avi ends
  /// after 120 of 245 frames; is it truncated?". Complete once next() has returned nothing.
  virtual std::string warning() const { return ""; }
};

/// Opens a recorded log (Matroska, decoded as live frames are), another video file, a folder of images
/// (sorted naturally by name) or a data folder that holds gelsight.avi. Frames larger than the profile's
/// resolution are cropped and resized as the public systems do (1/7 border, aspect kept); smaller or gray
/// ones are refused. Throws Error with what was wrong.
std::unique_ptr<FrameSource> open_frame_source(const std::filesystem::path& log,
                                               const SensorProfile& profile);

/// The pictures of a camera, or of a raw log, which may be shared with who stops it. Frames that cannot be
/// decoded are left out; warning() says so.
std::unique_ptr<FrameSource> decode_frames(std::shared_ptr<RawFrameSource> raw, const std::string& name,
                                           const SensorProfile& profile);

/// Raw frames to pictures of the profile's resolution: the one way from a sensor's bytes to what the gradient
/// model sees, for cameras and logs alike, so that both give the same surface. A JPEG that is much larger
/// than the profile is decoded at 1/2 or 1/4 scale before crop and area resize (the mean difference to full
/// decoding is below half a gray level, at a third of the time). Bytes after the JPEG's end are ignored. Not
/// thread-safe.
class FrameDecoder {
 public:
  explicit FrameDecoder(const SensorProfile& profile);
  ~FrameDecoder();

  /// Nothing when the bytes are no whole picture (torn JPEG, short buffer): damage() says what was wrong.
  /// Throws Error when the picture's size can never fit the profile.
  std::optional<TactileImage> decode(const RawFrame& frame);
  /// Of the last decode() that returned nothing: "JPEG ends early".
  const std::string& damage() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
