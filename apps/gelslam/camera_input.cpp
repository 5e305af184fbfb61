#include "camera_input.hpp"

#include <ctime>

#include "gelslam/core/process.hpp"
#include "gelslam/slam/config.hpp"

namespace gelslam {
namespace {

std::string settings_text(const std::vector<CameraSetting>& settings) {
  std::string text;
  for (const CameraSetting& setting : settings)
    text +=
        setting.name + " " + std::to_string(setting.value) + (setting.locked ? "" : " (automatic)") + "\n";
  return text;
}

}  // namespace

CameraInput open_camera_input(const Config& config, const std::string& device) {
  CameraOptions options = camera_options(config.sensor);
  if (!device.empty()) options.device = device;
  const InterruptWatch interrupt;
  options.gives_up = [&] { return interrupt.requested(); };
  std::unique_ptr<CameraSource> camera = open_camera(options);
  CameraInput input;
  input.attachments = attachments_of(config);
  input.attachments.sensor = camera->description();
  input.attachments.camera_settings = settings_text(camera->settings());
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

}  // namespace gelslam
