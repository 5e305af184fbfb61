#include "images/crop_window.hpp"

#include <algorithm>

#include "gelslam/core/text.hpp"

namespace gelslam::detail {
namespace {}  // namespace

PictureFit picture_fit(std::int64_t width_px, std::int64_t height_px, const SensorProfile& profile) {
  if (width_px == profile.width_px && height_px == profile.height_px) return PictureFit::as_it_is;
  const bool raw = width_px == profile.raw_width_px && height_px == profile.raw_height_px;
  // 5/7 of it must still be no smaller than what is wanted: enlarging would invent detail.
  const bool large_enough = width_px * 5 >= profile.width_px * 7 && height_px * 5 >= profile.height_px * 7;
  const double shape = (static_cast<double>(width_px) * profile.height_px) /
                       (static_cast<double>(height_px) * profile.width_px);
  const bool same_shape = shape > 0.9 && shape < 1.1;
  return raw || (large_enough && same_shape) ? PictureFit::crop : PictureFit::never;
}

std::string residual_text(std::int64_t width_px, std::int64_t height_px, const SensorProfile& profile) {
  return "is " + size_text(width_px, height_px) + " pixels; " + profile.device_name + " needs " +
         size_text(profile.width_px, profile.height_px) + ", or the camera's raw image (" +
         size_text(profile.raw_width_px, profile.raw_height_px) + "), see device_config";
}

cv::Rect crop_window(cv::Size raw, int width_px, int height_px) {
  const int border_x = raw.width / 7, border_y = raw.height / 7;
  cv::Rect window(border_x, border_y, raw.width - 2 * border_x, raw.height - 2 * border_y);
  const double aspect = static_cast<double>(width_px) / height_px;
  const int extra_rows = std::max(0, static_cast<int>(window.height - window.width / aspect));
  const int extra_columns = std::max(0, static_cast<int>(window.width - window.height * aspect));
  window.x += (extra_columns + 1) / 2;
  window.y += (extra_rows + 1) / 2;
  window.width = std::max(1, window.width - extra_columns);
  window.height = std::max(1, window.height - extra_rows);
  return window;
}

}  // namespace gelslam::detail
