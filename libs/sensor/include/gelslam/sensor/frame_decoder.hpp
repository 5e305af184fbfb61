#pragma once

#include <memory>
#include <optional>

#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/sensor/sensor_profile.hpp"
#include "gelslam/sensor/tactile_image.hpp"

namespace gelslam {

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
