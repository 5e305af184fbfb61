#include "simulated_camera.hpp"

#include <atomic>
#include <cstdlib>

#include "gelslam/core/files.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/sensor/sensor_profile.hpp"
#include "gelslam/simulation/optics.hpp"
#include "gelslam/simulation/simulator.hpp"

namespace gelslam {
namespace {

constexpr int kFrames = 1500;  ///< a minute

ScanSpec pebble() {
  ScanSpec spec;
  spec.object.name = "pebble";
  spec.motion.name = "allover";
  spec.motion.frames = kFrames;
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
    if (index_ == 0) start_unix_us_ = unix_us_now();  // it may have waited for a window
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
  const Simulator simulator_{pebble()};
  std::int64_t start_unix_us_ = 0;
  int index_ = 0;
  std::atomic<bool> stopped_{false};
};

std::filesystem::path cache_folder() {
  const auto variable = [](const char* name) -> std::filesystem::path {
    const char* value = std::getenv(name);
    return value != nullptr ? value : "";
  };
  const std::filesystem::path cache = variable("XDG_CACHE_HOME");
  if (cache.is_absolute()) return cache / "gelslam";
  const std::filesystem::path home = variable("HOME");
  return home.empty() ? std::filesystem::temp_directory_path() / "gelslam" : home / ".cache/gelslam";
}

}  // namespace

CameraInput open_simulated_camera(const Config& config) {
  CameraInput input{pace(std::make_unique<SimulatedCamera>()), attachments_of(config)};
  input.attachments.sensor = input.frames->description();
  return input;
}

std::filesystem::path simulated_camera_model() {
  const std::filesystem::path folder = cache_folder();
  std::error_code failure;  // what follows says it
  std::filesystem::create_directories(folder, failure);
  write_file_atomically(folder / "simulated_mini.json", mini_model_file());
  return folder / "simulated_mini.json";
}

}  // namespace gelslam
