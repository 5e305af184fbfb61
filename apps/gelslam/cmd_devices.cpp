#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "commands.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/camera.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

using Json = nlohmann::ordered_json;

struct Kind {
  const char *name, *words;
};

Kind kind_of(CameraNode node) {
  constexpr Kind kinds[] = {{"camera", "camera"},
                            {"metadata", "only metadata of this camera, no pictures"},
                            {"other", "no camera (an output or a decoder)"},
                            {"unknown", "cannot be opened"}};
  return kinds[static_cast<std::size_t>(node)];
}

Json mode_json(const CameraMode& mode) {
  Json json{{"format", mode.format}, {"width", mode.width_px}, {"height", mode.height_px}};
  if (mode.smallest_width_px != mode.width_px || mode.smallest_height_px != mode.height_px) {
    json["smallest_width"] = mode.smallest_width_px;
    json["smallest_height"] = mode.smallest_height_px;
  }
  json["rates_hz"] = mode.rates_hz;
  return json;
}

Json camera_json(const CameraInfo& camera) {
  Json json{{"path", camera.path},
            {"kind", kind_of(camera.node).name},
            {"name", camera.name},
            {"driver", camera.driver},
            {"bus", camera.bus},
            {"sensor", camera.sensor},
            {"in_use_by", camera.in_use_by},
            {"problem", camera.problem}};
  json["modes"] = Json::array();
  for (const CameraMode& mode : camera.modes) json["modes"].push_back(mode_json(mode));
  json["controls"] = Json::array();
  for (const CameraSetting& setting : camera.settings) {
    json["controls"].push_back(
        {{"name", setting.name}, {"value", setting.value}, {"automatic", !setting.locked}});
  }
  return json;
}

std::string controls_text(const CameraInfo& camera) {
  std::ostringstream text;
  for (const CameraSetting& setting : camera.settings) {
    text << (text.tellp() == 0 ? "" : ", ") << setting.name << "=" << setting.value
         << (setting.locked ? "" : " (automatic)");
  }
  return text.str();
}

/// Formats that the program can read; a driver may have dozens of others.
bool can_be_read(const CameraMode& mode) {
  return mode.format == "MJPG" || mode.format == "JPEG" || mode.format == "YUYV";
}

std::string other_formats(const CameraInfo& camera) {
  std::string text;
  std::set<std::string> seen;
  for (const CameraMode& mode : camera.modes) {
    if (!can_be_read(mode) && seen.insert(mode.format).second)
      text += (text.empty() ? "" : ", ") + mode.format;
  }
  return text.empty() ? "" : text + " (not read by this program)";
}

std::string camera_text(const CameraInfo& camera) {
  std::ostringstream text;
  const auto line = [&text](const char* key, const std::string& words) {
    if (!words.empty()) text << "  " << key << one_line(words) << "\n";
  };
  text << camera.path << "  " << one_line(camera.name) << "\n";
  line("kind      ", std::string(kind_of(camera.node).words) +
                         (camera.sensor.empty() ? "" : ", looks like a " + camera.sensor));
  line("bus       ", camera.bus + (camera.driver.empty() ? "" : " (" + camera.driver + ")"));
  for (const CameraMode& mode : camera.modes) {
    if (can_be_read(mode)) line("format    ", mode_text(mode));
  }
  line("also      ", other_formats(camera));
  line("controls  ", controls_text(camera));
  line("in use by ", camera.in_use_by);
  line("problem   ", camera.problem);
  return text.str();
}

std::string cameras_text(const std::vector<CameraInfo>& cameras) {
  if (cameras.empty()) {
    return "no camera is connected: there is no /dev/video node (plug the sensor in; a container or virtual "
           "machine must be given the device)\n";
  }
  std::string text;
  for (const CameraInfo& camera : cameras) text += camera_text(camera);
  return text;
}

int run_devices(bool as_json) {
  const std::vector<CameraInfo> cameras = list_cameras();
  if (as_json) {
    Json json{{"cameras", Json::array()}};
    for (const CameraInfo& camera : cameras) json["cameras"].push_back(camera_json(camera));
    // A camera's name may contain any bytes; those that are not UTF-8 are replaced.
    std::cout << json.dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    std::cout << cameras_text(cameras);
  }
  for (const CameraInfo& camera : cameras) {
    if (camera.node == CameraNode::capture) return kExitDone;
  }
  return kExitNotGood;
}

}  // namespace

void add_devices_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand(
      "devices", "List the cameras with their formats, rates and controls; mark the touch sensors");
  const auto as_json = std::make_shared<bool>(false), quiet = std::make_shared<bool>(false);
  command->add_flag("--json", *as_json, "Print one JSON object for another program");
  add_quiet_flag(*command, *quiet);  // The command prints nothing but the result.
  command->footer("Example: gelslam devices\nExit code 1: there is no camera that can be opened.");
  command->callback([as_json, quiet, &exit_code] { exit_code = run_devices(*as_json); });
}

}  // namespace gelslam
