#include <fmt/core.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <cmath>

#include "cameras/v4l2_camera.hpp"

namespace gelslam::detail {
namespace {

std::string format_text(std::uint32_t fourcc, std::uint32_t width, std::uint32_t height) {
  return fourcc_text(fourcc) + " " + std::to_string(width) + "x" + std::to_string(height);
}

std::uint32_t fourcc_of(FrameEncoding encoding) {
  return encoding == FrameEncoding::jpeg ? V4L2_PIX_FMT_MJPEG : V4L2_PIX_FMT_YUYV;
}

/// JPEG and MJPG are two names for the same pictures.
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
  picture.pixelformat = fourcc_of(options.encoding);
  picture.width = static_cast<std::uint32_t>(options.width_px);
  picture.height = static_cast<std::uint32_t>(options.height_px);
  picture.field = V4L2_FIELD_ANY;
  const v4l2_pix_format asked = picture;
  if (const int code = node.call(VIDIOC_S_FMT, &format); code == EINVAL) {
    throw CameraFailure(node.path() + ": the driver refuses " +
                            format_text(asked.pixelformat, asked.width, asked.height) + what_there_is(node),
                        code);
  } else if (code != 0) {
    throw camera_failure(node.system(), node.path(), "set the format", code);
  }
  if (same_pictures(asked.pixelformat, picture.pixelformat) && asked.width == picture.width &&
      asked.height == picture.height)
    return picture;
  throw Error(node.path() + ": asked for " + format_text(asked.pixelformat, asked.width, asked.height) +
              ", the driver gave " + format_text(picture.pixelformat, picture.width, picture.height) +
              what_there_is(node));
}

std::string hertz(double rate_hz) { return fmt::format("{:g} Hz", std::round(rate_hz * 100) / 100); }

/// Hz, or 0 where the driver does not say.
double set_rate(const VideoNode& node, double rate_hz) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  v4l2_fract& interval = parameters.parm.capture.timeperframe;
  interval.numerator = 1000;
  interval.denominator = static_cast<std::uint32_t>(std::lround(rate_hz * 1000));
  if (node.call(VIDIOC_S_PARM, &parameters) != 0) return 0;
  return interval.numerator == 0 ? 0.0 : static_cast<double>(interval.denominator) / interval.numerator;
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

}  // namespace gelslam::detail
