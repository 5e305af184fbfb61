#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <sstream>
#include <string_view>

#include "cameras/v4l2_camera.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam {
namespace {

std::pair<std::string, std::int64_t> parse_control(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string name = trimmed(text.substr(0, equals));
  const std::string number = equals == std::string::npos ? "" : trimmed(text.substr(equals + 1));
  std::int64_t value = 0;
  const auto [end, code] = std::from_chars(number.data(), number.data() + number.size(), value);
  if (name.empty() || number.empty() || code != std::errc() || end != number.data() + number.size())
    throw Error("device_config.camera_controls: \"" + text +
                "\" is not name=number; write \"exposure_time_absolute=120, gain=3\"");
  return {name, value};
}

std::vector<std::pair<std::string, std::int64_t>> parse_controls(const std::string& text) {
  std::vector<std::pair<std::string, std::int64_t>> controls;
  std::istringstream parts(trimmed(text).empty() ? "" : text + ",");
  for (std::string part; std::getline(parts, part, ',');) controls.push_back(parse_control(trimmed(part)));
  return controls;
}

FrameEncoding parse_format(const std::string& format) {
  if (format == "MJPG") return FrameEncoding::jpeg;
  if (format == "YUYV") return FrameEncoding::yuyv;
  throw Error("device_config.camera_format: \"" + format + "\" is neither MJPG nor YUYV");
}

}  // namespace

CameraOptions camera_options(const SensorProfile& profile) {
  CameraOptions options;
  options.device = profile.camera;
  options.sensor = profile.device_name;
  options.encoding = parse_format(profile.camera_format);
  options.width_px = profile.raw_width_px;
  options.height_px = profile.raw_height_px;
  options.rate_hz = profile.frame_rate_hz;
  options.controls = parse_controls(profile.camera_controls);
  return options;
}

namespace detail {
namespace {

// A camera's name is its USB product string: "GelSight Mini R0B 2BNN-4ZE7", "DIGIT: DIGIT".
constexpr std::array<std::string_view, 2> kKnownSensors{"GelSight Mini", "DIGIT"};

CameraInfo look_at(const std::string& path, const VideoSystem& system) {
  CameraInfo info;
  info.path = path;
  try {
    const VideoNode node(system, path);
    info = node.identity();
    if (info.node == CameraNode::capture) {
      info.sensor = known_sensor(info.name);
      info.modes = camera_modes(node);
      info.settings = read_controls(node);
    }
  } catch (const CameraFailure& failure) {
    info.problem = std::string(failure.what()).substr(path.size() + 2);  // Without the prefix "path: ".
  }
  info.in_use_by = system.held_by(path);
  return info;
}

std::string what_there_is(const std::vector<CameraInfo>& cameras) {
  std::string text;
  for (const CameraInfo& camera : cameras) {
    if (camera.node != CameraNode::capture && camera.problem.empty()) continue;
    text += (text.empty() ? "there is " : ", ") + camera.path + " (" +
            (camera.problem.empty() ? camera.name : camera.problem) + ")";
  }
  return text.empty() ? "no camera is connected" : text;
}

std::vector<CameraInfo> cameras_where(const std::vector<CameraInfo>& cameras, const auto& fits) {
  std::vector<CameraInfo> result;
  std::copy_if(cameras.begin(), cameras.end(), std::back_inserter(result),
               [&](const CameraInfo& camera) { return camera.node == CameraNode::capture && fits(camera); });
  return result;
}

}  // namespace

std::string known_sensor(const std::string& name) {
  for (const std::string_view sensor : kKnownSensors) {
    const std::size_t at = name.find(sensor), end = at + sensor.size();
    if (at != std::string::npos &&
        (end == name.size() || !std::isalnum(static_cast<unsigned char>(name[end]))))
      return std::string(sensor);
  }
  return "";
}

std::string find_camera(const CameraOptions& options, const VideoSystem& system) {
  const std::string& device = options.device;
  if (device.starts_with("/")) return device;
  if (!device.empty() && device.find_first_not_of("0123456789") == std::string::npos)
    return "/dev/video" + device;
  const bool by_sensor = device == "auto" || device.empty();
  const std::string sensor = known_sensor(options.sensor);
  const std::vector<CameraInfo> cameras = list_cameras(system);
  const auto found = cameras_where(cameras, [&](const CameraInfo& camera) {
    if (!by_sensor) return camera.name.find(device) != std::string::npos;
    return !camera.sensor.empty() && (sensor.empty() || camera.sensor == sensor);
  });
  if (found.size() == 1) return found.front().path;
  const std::string wanted = !by_sensor       ? "camera has \"" + device + "\" in its name"
                             : sensor.empty() ? "camera of a known touch sensor"
                                              : sensor;
  if (found.empty() && !by_sensor) throw Error("no " + wanted + ": " + what_there_is(cameras));
  const char* const advice = !by_sensor        ? "; give more of the name, or the path"
                             : cameras.empty() ? "; plug it in"
                                               : "; name the camera or set device_config.camera";
  throw Error((found.empty() ? "no " + wanted + " found: " + what_there_is(cameras)
                             : "more than one " + wanted + ": " + what_there_is(found)) +
              advice);
}

std::vector<std::string> nodes_named(const std::string& name, const VideoSystem& system) {
  std::vector<std::string> nodes;
  for (const CameraInfo& camera : list_cameras(system))
    if (camera.node == CameraNode::capture && camera.name == name) nodes.push_back(camera.path);
  return nodes;
}

std::string find_again(const CameraInfo& camera, const std::vector<std::string>& others,
                       const VideoSystem& system) {
  for (const std::string& path : nodes_named(camera.name, system))
    if (std::ranges::count(others, path) == 0 || VideoNode(system, path).identity().bus == camera.bus)
      return path;
  throw Error(camera.name + " is away");
}

std::string capture_node_beside(const std::string& path, const std::string& bus, const VideoSystem& system) {
  for (const CameraInfo& camera : list_cameras(system))
    if (camera.path != path && camera.bus == bus && camera.node == CameraNode::capture) return camera.path;
  return "";
}

}  // namespace detail

std::vector<CameraInfo> list_cameras(const detail::VideoSystem& system) {
  std::vector<CameraInfo> cameras;
  for (const std::string& path : system.nodes()) cameras.push_back(detail::look_at(path, system));
  return cameras;
}

}  // namespace gelslam
