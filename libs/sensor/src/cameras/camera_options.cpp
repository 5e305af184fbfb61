#include <charconv>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/camera.hpp"

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
  if (trimmed(text).empty()) return controls;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    controls.push_back(parse_control(trimmed(text.substr(at, end - at))));
    at = end + 1;
  }
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

}  // namespace gelslam
