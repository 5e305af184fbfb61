#include "gelslam/simulation/simulated_camera.hpp"

#include <atomic>

#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/simulation/simulator.hpp"

namespace gelslam {
namespace {

ScanSpec pebble_scan() {
  ScanSpec spec;
  spec.object.name = "pebble";
  spec.motion.name = "allover";
  spec.motion.frames = 1500;  // one minute at 25 Hz
  spec.background_frames = 25;
  spec.geometry.optics = kGelSightMiniOptics;
  return spec;
}

class SimulatedCamera final : public RawFrameSource {
 public:
  std::optional<RawFrame> next() override {
    if (stopped_ || index_ >= simulator_.frame_count()) return std::nullopt;
    const SimulatedFrame frame = simulator_.frame(index_);
    RawFrame raw;
    raw.encoding = FrameEncoding::bgr;
    raw.width_px = frame.bgr.cols;
    raw.height_px = frame.bgr.rows;
    raw.bytes.assign(frame.bgr.datastart, frame.bgr.dataend);
    raw.time_s = frame.time_s;
    // Set with the first frame and not in the constructor, because the program may open its window in
    // between.
    if (index_ == 0) start_unix_us_ = unix_us_now();
    raw.unix_us = unix_us_of(start_unix_us_, raw.time_s);
    raw.index = raw.sequence = index_++;
    raw.arrived = std::chrono::steady_clock::now();
    return raw;
  }
  void stop() override { stopped_ = true; }
  double rate_hz() const override { return simulator_.spec().motion.frame_rate_hz; }
  std::optional<std::int64_t> frame_count() const override { return simulator_.frame_count(); }
  std::string description() const override { return "simulated sensor"; }

 private:
  const Simulator simulator_{pebble_scan()};
  std::int64_t start_unix_us_ = 0;
  int index_ = 0;
  std::atomic<bool> stopped_{false};
};

}  // namespace

std::unique_ptr<RawFrameSource> simulated_camera() { return pace(std::make_unique<SimulatedCamera>()); }

}  // namespace gelslam
