#include "camera_input.hpp"

#include <ctime>
#include <filesystem>

#include "gelslam/core/error.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/sensor/log_recorder.hpp"
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

CameraOptions options_of(const Config& config, const std::string& device) {
  CameraOptions options = camera_options(config.sensor);
  if (!device.empty()) options.device = device;
  return options;
}

/// Some drivers open one camera twice, others say that this program uses it already.
void check_two_cameras(std::span<const Config> configs, std::span<const std::string> devices) {
  const std::string first = find_camera(options_of(configs[0], devices[0])),
                    second = find_camera(options_of(configs[1], devices[1]));
  std::error_code code;
  if (first == second || std::filesystem::equivalent(first, second, code))
    throw Error("--camera " + devices[0] + " and --camera " + devices[1] + " are both " + first +
                "; name two cameras");
}

}  // namespace

CameraInput open_camera_input(const Config& config, const std::string& device) {
  CameraOptions options = options_of(config, device);
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

std::vector<CameraInput> open_camera_inputs(std::span<const Config> configs,
                                            std::span<const std::string> devices) {
  if (devices.size() > 1) check_two_cameras(configs, devices);
  std::vector<CameraInput> inputs;
  for (std::size_t i = 0; i < devices.size(); ++i)
    inputs.push_back(open_camera_input(configs[i], devices[i]));
  if (inputs.size() > 1) put_on_one_clock(inputs[0].frames, inputs[1].frames);
  return inputs;
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
