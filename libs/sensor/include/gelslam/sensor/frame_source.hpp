#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/sensor/sensor_profile.hpp"
#include "gelslam/sensor/tactile_image.hpp"

namespace gelslam {

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

}  // namespace gelslam
