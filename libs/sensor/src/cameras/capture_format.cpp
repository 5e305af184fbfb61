#include <fmt/core.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>

#include "cameras/v4l2_camera.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam {
namespace detail {
namespace {

/// Returns "MJPG" for V4L2_PIX_FMT_MJPEG; characters that cannot be printed become '?'.
std::string fourcc_text(std::uint32_t fourcc) {
  std::string text;
  for (int i = 0; i < 4; ++i, fourcc >>= 8) {
    const char c = static_cast<char>(fourcc & 0x7f);
    text += c >= ' ' && c <= '~' ? c : '?';
  }
  return text.substr(0, text.find_last_not_of(' ') + 1);
}

// The lists of a faulty driver may be endless.
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
             rate_of(interval.stepwise.max)};  // The shortest interval is the highest rate.
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

namespace {

/// Returns a text for the user: "MJPG 3280x2464 at 25 Hz; YUYV 640x480 at 30, 15 Hz", or "no formats".
std::string modes_text(const std::vector<CameraMode>& modes) {
  if (modes.empty()) return "no formats";
  std::string text;
  for (std::size_t i = 0; i < modes.size(); ++i) {
    if (i == kMaxModesInWords) return text + " and " + std::to_string(modes.size() - i) + " more";
    text += (i == 0 ? "" : "; ") + mode_text(modes[i]);
  }
  return text;
}

std::string format_text(std::uint32_t fourcc, std::uint32_t width, std::uint32_t height) {
  return fourcc_text(fourcc) + " " + size_text(width, height);
}

/// JPEG and MJPG are two names for the same format.
bool same_pictures(std::uint32_t asked, std::uint32_t granted) {
  return asked == granted || (asked == V4L2_PIX_FMT_MJPEG && granted == V4L2_PIX_FMT_JPEG);
}

std::string what_there_is(const VideoNode& node) {
  return "; the camera offers " + modes_text(camera_modes(node)) +
         ": see camera_format, raw_imgw and raw_imgh in device_config";
}

v4l2_pix_format set_format(const VideoNode& node, const CameraOptions& options) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  v4l2_pix_format& picture = format.fmt.pix;
  picture.pixelformat = options.encoding == FrameEncoding::jpeg ? V4L2_PIX_FMT_MJPEG : V4L2_PIX_FMT_YUYV;
  picture.width = static_cast<std::uint32_t>(options.width_px);
  picture.height = static_cast<std::uint32_t>(options.height_px);
  picture.field = V4L2_FIELD_ANY;
  const v4l2_pix_format asked = picture;
  const int code = node.call(VIDIOC_S_FMT, &format);
  if (code == EINVAL)
    throw CameraFailure(node.path() + ": the driver refuses " +
                            format_text(asked.pixelformat, asked.width, asked.height) + what_there_is(node),
                        code);
  if (code != 0) throw node.failure("set the format", code);
  if (same_pictures(asked.pixelformat, picture.pixelformat) && asked.width == picture.width &&
      asked.height == picture.height)
    return picture;
  throw Error(node.path() + ": asked for " + format_text(asked.pixelformat, asked.width, asked.height) +
              ", the driver gave " + format_text(picture.pixelformat, picture.width, picture.height) +
              what_there_is(node));
}

std::string hertz(double rate_hz) { return fmt::format("{:g} Hz", std::round(rate_hz * 100) / 100); }

/// Returns the granted rate in Hz, or 0 if the driver does not say.
double set_rate(const VideoNode& node, double rate_hz) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  v4l2_fract& interval = parameters.parm.capture.timeperframe;
  interval.numerator = 1000;
  interval.denominator = static_cast<std::uint32_t>(std::lround(rate_hz * 1000));
  if (node.call(VIDIOC_S_PARM, &parameters) != 0) return 0;
  return rate_of(interval);
}

}  // namespace

CaptureFormat negotiate_format(const VideoNode& node, const CameraOptions& options) {
  const v4l2_pix_format picture = set_format(node, options);
  CaptureFormat result;
  if (options.encoding == FrameEncoding::yuyv)
    result.row_bytes = std::max<std::size_t>(picture.bytesperline, 2 * std::size_t{picture.width});
  const double granted_hz = set_rate(node, options.rate_hz);
  result.rate_hz = granted_hz > 0 ? granted_hz : options.rate_hz;
  if (granted_hz <= 0)
    result.warning = "the driver does not say its rate";
  else if (std::abs(granted_hz - options.rate_hz) > 0.02 * options.rate_hz)
    result.warning = "asked for " + hertz(options.rate_hz) + ", the driver gives " + hertz(granted_hz);
  return result;
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
