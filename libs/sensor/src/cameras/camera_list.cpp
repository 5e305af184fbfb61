#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

#include "cameras/v4l2_camera.hpp"
#include "cameras/video_node.hpp"

namespace gelslam {
namespace detail {
namespace {

// A camera's name is its USB product string: "GelSight Mini R0B 2BNN-4ZE7", "DIGIT: DIGIT".
constexpr std::array<std::string_view, 2> kKnownSensors{"GelSight Mini", "DIGIT"};

CameraInfo look_at(const std::string& path, const VideoSystem& system) {
  CameraInfo info;
  info.path = path;
  info.in_use_by = system.held_by(path);
  try {
    const VideoNode node(system, path);
    const NodeIdentity identity = node.identity();
    info.name = identity.name;
    info.driver = identity.driver;
    info.bus = identity.bus;
    info.node = identity.kind();
    if (info.node != CameraNode::capture) return info;
    info.sensor = known_sensor(info.name);
    info.modes = camera_modes(node);
    info.settings = read_controls(node);
  } catch (const CameraFailure& failure) {
    info.problem = std::string(failure.what()).substr(path.size() + 2);  // without "path: "
  }
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

std::string find_known_sensor(const std::string& wanted, const std::vector<CameraInfo>& cameras) {
  const auto found = cameras_where(cameras, [&](const CameraInfo& camera) {
    return !camera.sensor.empty() && (wanted.empty() || camera.sensor == wanted);
  });
  const std::string looked_for = wanted.empty() ? "camera of a known touch sensor" : wanted;
  if (found.size() > 1)
    throw Error("more than one " + looked_for + ": " + what_there_is(found) +
                "; name the camera or set device_config.camera");
  if (!found.empty()) return found.front().path;
  throw Error("no " + looked_for + " found: " + what_there_is(cameras) +
              (cameras.empty() ? "; plug it in" : "; name the camera or set device_config.camera"));
}

std::string find_by_name(const std::string& part, const std::vector<CameraInfo>& cameras) {
  const auto found = cameras_where(
      cameras, [&](const CameraInfo& camera) { return camera.name.find(part) != std::string::npos; });
  if (found.empty()) throw Error("no camera has \"" + part + "\" in its name: " + what_there_is(cameras));
  if (found.size() > 1)
    throw Error("more than one camera has \"" + part + "\" in its name: " + what_there_is(found) +
                "; give more of the name, or the path");
  return found.front().path;
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

std::vector<CameraInfo> list_cameras(const VideoSystem& system) {
  std::vector<CameraInfo> cameras;
  for (const std::string& path : system.nodes()) cameras.push_back(look_at(path, system));
  return cameras;
}

std::string find_camera(const CameraOptions& options, const VideoSystem& system) {
  const std::string& device = options.device;
  if (device.starts_with("/")) return device;
  if (!device.empty() && device.find_first_not_of("0123456789") == std::string::npos)
    return "/dev/video" + device;
  if (device == "auto" || device.empty())
    return find_known_sensor(known_sensor(options.sensor), list_cameras(system));
  return find_by_name(device, list_cameras(system));
}

std::vector<std::string> nodes_named(const std::string& name, const VideoSystem& system) {
  std::vector<std::string> nodes;
  for (const CameraInfo& camera : list_cameras(system))
    if (camera.node == CameraNode::capture && camera.name == name) nodes.push_back(camera.path);
  return nodes;
}

std::string find_again(const NodeIdentity& camera, const std::vector<std::string>& others,
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

std::string find_camera(const CameraOptions& options) {
  return detail::find_camera(options, detail::linux_video_system());
}

std::vector<CameraInfo> list_cameras() { return detail::list_cameras(detail::linux_video_system()); }

}  // namespace gelslam
