#include <fmt/core.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>

#include "cameras/v4l2_camera.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam {
namespace detail {
namespace {

// A driver's lists end by themselves; a broken one's need not.
constexpr std::uint32_t kMaxFormats = 64, kMaxSizes = 128, kMaxRates = 64;
constexpr std::size_t kMaxModesInWords = 12;

double rate_of(const v4l2_fract& interval) {
  return interval.numerator == 0 ? 0.0 : static_cast<double>(interval.denominator) / interval.numerator;
}

std::vector<double> rates_of(const VideoNode& node, std::uint32_t format, std::uint32_t width,
                             std::uint32_t height) {
  std::vector<double> rates;
  for (std::uint32_t i = 0; i < kMaxRates; ++i) {
    v4l2_frmivalenum interval{};
    interval.index = i;
    interval.pixel_format = format;
    interval.width = width;
    interval.height = height;
    if (node.call(VIDIOC_ENUM_FRAMEINTERVALS, &interval) != 0) break;
    if (interval.type == V4L2_FRMIVAL_TYPE_DISCRETE) {
      rates.push_back(rate_of(interval.discrete));
      continue;
    }
    rates = {rate_of(interval.stepwise.min),
             rate_of(interval.stepwise.max)};  // the shortest interval is the fastest
    break;
  }
  std::erase_if(rates, [](double rate) { return !(rate > 0); });
  std::sort(rates.rbegin(), rates.rend());
  rates.erase(std::unique(rates.begin(), rates.end()), rates.end());
  return rates;
}

void add_sizes(const VideoNode& node, std::uint32_t format, std::vector<CameraMode>& modes) {
  for (std::uint32_t i = 0; i < kMaxSizes; ++i) {
    v4l2_frmsizeenum size{};
    size.index = i;
    size.pixel_format = format;
    if (node.call(VIDIOC_ENUM_FRAMESIZES, &size) != 0) break;
    const bool fixed = size.type == V4L2_FRMSIZE_TYPE_DISCRETE;
    const std::uint32_t width = fixed ? size.discrete.width : size.stepwise.max_width;
    const std::uint32_t height = fixed ? size.discrete.height : size.stepwise.max_height;
    CameraMode mode;
    mode.format = fourcc_text(format);
    mode.width_px = static_cast<int>(width);
    mode.height_px = static_cast<int>(height);
    mode.smallest_width_px = fixed ? mode.width_px : static_cast<int>(size.stepwise.min_width);
    mode.smallest_height_px = fixed ? mode.height_px : static_cast<int>(size.stepwise.min_height);
    mode.rates_hz = rates_of(node, format, width, height);
    modes.push_back(std::move(mode));
    if (!fixed) break;
  }
}

}  // namespace

std::string fourcc_text(std::uint32_t fourcc) {
  std::string text;
  for (int i = 0; i < 4; ++i, fourcc >>= 8) {
    const char c = static_cast<char>(fourcc & 0x7f);
    text += c >= ' ' && c <= '~' ? c : '?';
  }
  return text.substr(0, text.find_last_not_of(' ') + 1);
}

std::vector<CameraMode> camera_modes(const VideoNode& node) {
  std::vector<CameraMode> modes;
  for (std::uint32_t i = 0; i < kMaxFormats; ++i) {
    v4l2_fmtdesc format{};
    format.index = i;
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (node.call(VIDIOC_ENUM_FMT, &format) != 0) break;
    add_sizes(node, format.pixelformat, modes);
  }
  return modes;
}

std::string modes_text(const std::vector<CameraMode>& modes) {
  if (modes.empty()) return "no formats";
  std::string text;
  for (std::size_t i = 0; i < modes.size(); ++i) {
    if (i == kMaxModesInWords) return text + " and " + std::to_string(modes.size() - i) + " more";
    text += (i == 0 ? "" : "; ") + mode_text(modes[i]);
  }
  return text;
}

}  // namespace detail

std::string mode_text(const CameraMode& mode) {
  std::string text = mode.format + " ";
  if (mode.smallest_width_px != mode.width_px || mode.smallest_height_px != mode.height_px)
    text += size_text(mode.smallest_width_px, mode.smallest_height_px) + " to ";
  text += size_text(mode.width_px, mode.height_px);
  for (std::size_t i = 0; i < mode.rates_hz.size(); ++i)
    text += fmt::format("{}{:g}", i == 0 ? " at " : ", ", std::round(mode.rates_hz[i] * 100) / 100);
  return mode.rates_hz.empty() ? text : text + " Hz";
}

}  // namespace gelslam
