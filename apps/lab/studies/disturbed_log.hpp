#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <string>

#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/raw_log.hpp"

namespace gelslam::lab {

/// A picture while it is changed: gray levels, and when it was taken.
struct Picture {
  cv::Mat3f bgr;
  double time_s = 0, progress = 0;  ///< progress: 0 at the first frame after the background, 1 at the end
  int number = 0;                   ///< 0 at the first frame after the background
};

struct Disturbance {
  const char* name;
  void (*apply)(Picture&);
};

/// What happens to pictures: the light, the pixels, the optics.
std::span<const Disturbance> disturbances();

/// A log whose pictures after the background are disturbed.
class DisturbedLog : public RawFrameSource {
 public:
  /// `frames`: after the background.
  DisturbedLog(std::unique_ptr<FrameSource> source, int background_frames, std::int64_t frames,
               const Disturbance& disturbance)
      : source_(std::move(source)),
        background_frames_(background_frames),
        frames_(frames),
        disturbance_(disturbance) {}

  std::optional<RawFrame> next() override;
  void stop() override {}
  double rate_hz() const override { return source_->rate_hz(); }
  std::string description() const override { return source_->description(); }

 private:
  std::unique_ptr<FrameSource> source_;
  const int background_frames_;
  const std::int64_t frames_;
  const Disturbance& disturbance_;
};

}  // namespace gelslam::lab
