#include "camera_input.hpp"

#include <cstdlib>
#include <ctime>
#include <future>
#include <utility>

#include "gelslam/core/files.hpp"
#include "gelslam/sensor/log_recorder.hpp"
#include "gelslam/simulation/optics.hpp"
#include "gelslam/simulation/simulated_camera.hpp"

namespace gelslam {
namespace {

std::string settings_text(const std::vector<CameraSetting>& settings) {
  std::string text;
  for (const CameraSetting& setting : settings)
    text +=
        setting.name + " " + std::to_string(setting.value) + (setting.locked ? "" : " (automatic)") + "\n";
  return text;
}

CameraOptions options_of(const Config& config, const std::string& device) {
  CameraOptions options = camera_options(config.sensor);
  if (!device.empty()) options.device = device;
  return options;
}

class AfterBackground final : public RawFrameSource {
 public:
  AfterBackground(BackgroundFrames background, std::unique_ptr<RawFrameSource> camera)
      : background_(std::move(background)), camera_(std::move(camera)) {}

  std::optional<RawFrame> next() override {
    const std::int64_t count = std::ssize(background_);
    const double camera_s = static_cast<double>(count) / rate_hz();
    std::optional<RawFrame> frame;
    if (next_ < count) {
      // The time of its first frame is the start of the sequence.
      if (next_ == 0 && !(first_ = camera_->next())) return frame;
      frame = *background_[static_cast<std::size_t>(next_)];
      frame->index = frame->sequence = next_;
      frame->time_s = static_cast<double>(next_) / rate_hz();
      frame->unix_us = unix_us_of(first_->unix_us, frame->time_s - camera_s);
      frame->arrived = std::chrono::steady_clock::now();
      frame->age = {};
      ++next_;
      return frame;
    }
    frame = first_ ? std::exchange(first_, std::nullopt) : camera_->next();
    if (!frame) return frame;
    if (!first_sequence_) first_sequence_ = frame->sequence;
    frame->index += count;
    frame->sequence += count - *first_sequence_;
    frame->time_s += camera_s;
    return frame;
  }
  void stop() override { camera_->stop(); }
  bool hold(bool held) override { return camera_->hold(held); }
  double rate_hz() const override { return camera_->rate_hz(); }
  std::string description() const override { return camera_->description(); }
  std::string disconnect_reason() const override { return camera_->disconnect_reason(); }
  std::int64_t lost_frames() const override { return camera_->lost_frames(); }
  std::string warning() const override { return camera_->warning(); }

 private:
  const BackgroundFrames background_;
  const std::unique_ptr<RawFrameSource> camera_;
  std::optional<RawFrame> first_;  // First frame of the camera, read before it is delivered.
  std::int64_t next_ = 0;
  std::optional<std::int64_t> first_sequence_;  // The driver's counter may start at any number.
};

std::filesystem::path cache_folder() {
  for (const auto& [variable, below] : {std::pair("XDG_CACHE_HOME", "gelslam"), {"HOME", ".cache/gelslam"}})
    if (const char* folder = std::getenv(variable); folder != nullptr && *folder == '/')
      return std::filesystem::path(folder) / below;
  return std::filesystem::temp_directory_path() / "gelslam";
}

}  // namespace

std::unique_ptr<RawFrameSource> after_background(BackgroundFrames background,
                                                 std::unique_ptr<RawFrameSource> camera) {
  return std::make_unique<AfterBackground>(std::move(background), std::move(camera));
}

CameraInput open_camera_input(const Config& config, const std::string& device, double reconnect_timeout_s) {
  if (device == kSimulatedCamera) {
    CameraInput input{simulated_camera(), attachments_of(config)};
    input.attachments->sensor = input.frames->description();
    return input;
  }
  CameraOptions options = options_of(config, device);
  options.reconnect_timeout_s = reconnect_timeout_s;
  const InterruptWatch interrupt;
  options.gives_up = [&] { return interrupt.requested(); };
  std::unique_ptr<CameraSource> camera = open_camera(options);
  CameraInput input;
  input.attachments = attachments_of(config);
  input.attachments->sensor = camera->description();
  input.attachments->camera_settings = settings_text(camera->settings());
  input.frames = std::move(camera);
  return input;
}

std::string name_by_time() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  ::localtime_r(&now, &local);
  char name[64];
  std::strftime(name, sizeof name, "gelslam-%Y%m%d-%H%M%S", &local);
  return name;
}

void work_beside_window(const std::function<void()>& work, const std::function<void()>& show,
                        const std::function<void()>& stop) {
  std::future<void> done = std::async(std::launch::async, work);  // Also waited for if `show` throws.
  try {
    show();
  } catch (...) {
    stop();
    throw;
  }
  stop();
  done.get();
}

void use_simulated_model(const std::string& device, std::string& model) {
  if (device != kSimulatedCamera || !model.empty()) return;
  const std::filesystem::path folder = cache_folder();
  std::error_code failure;  // Errors are reported by the following calls.
  std::filesystem::create_directories(folder, failure);
  write_file_atomically(folder / "simulated_mini.json", mini_model_file());
  model = folder / "simulated_mini.json";
}

}  // namespace gelslam
