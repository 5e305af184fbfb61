#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "images/sources.hpp"

namespace gelslam::detail {
namespace {

/// Input pixels that an output pixel averages along one axis, with weights that sum to 1.
struct Footprint {
  int first = 0;
  std::vector<float> weights;
};

std::vector<Footprint> footprints(double begin, double length, int outputs, int inputs) {
  const double step = length / outputs;
  std::vector<Footprint> result(static_cast<std::size_t>(outputs));
  for (int i = 0; i < outputs; ++i) {
    const double low = std::clamp(begin + i * step, 0.0, inputs - 1e-6);
    const double high = std::clamp(begin + (i + 1) * step, low + 1e-6, static_cast<double>(inputs));
    Footprint& footprint = result[static_cast<std::size_t>(i)];
    footprint.first = static_cast<int>(std::floor(low));
    const int last = std::min(inputs - 1, static_cast<int>(std::ceil(high)) - 1);
    for (int k = footprint.first; k <= last; ++k) {
      const double covered = std::min<double>(high, k + 1) - std::max<double>(low, k);
      footprint.weights.push_back(static_cast<float>(std::max(0.0, covered) / (high - low)));
    }
  }
  return result;
}

void average_rows(const cv::Mat3b& image, const Footprint& rows, std::vector<float>& sum) {
  std::fill(sum.begin(), sum.end(), 0.0f);
  for (std::size_t k = 0; k < rows.weights.size(); ++k) {
    const uchar* row = image.ptr(rows.first + static_cast<int>(k));
    const float weight = rows.weights[k];
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += weight * static_cast<float>(row[i]);
  }
}

void average_columns(const std::vector<float>& row, const std::vector<Footprint>& columns,
                     cv::Vec3b* output) {
  for (std::size_t u = 0; u < columns.size(); ++u) {
    float blue = 0.5f, green = 0.5f, red = 0.5f;  // Offset so that truncation rounds.
    const float* pixel = row.data() + 3 * columns[u].first;
    for (const float weight : columns[u].weights) {
      blue += weight * pixel[0];
      green += weight * pixel[1];
      red += weight * pixel[2];
      pixel += 3;
    }
    output[u] = cv::Vec3b(static_cast<uchar>(blue), static_cast<uchar>(green), static_cast<uchar>(red));
  }
}

/// True for an image larger than the profile's and of about its aspect ratio, which may be cropped already or
/// not.
bool may_be_enlarged(std::int64_t width_px, std::int64_t height_px, const SensorProfile& profile) {
  const double shape = (static_cast<double>(width_px) * profile.height_px) /
                       (static_cast<double>(height_px) * profile.width_px);
  return width_px >= profile.width_px && height_px >= profile.height_px && shape > 0.9 && shape < 1.1;
}

}  // namespace

bool fits_any_sensor(std::int64_t width_px, std::int64_t height_px) {
  // Each side is checked first, because the product could overflow.
  return width_px <= kMaxPicturePixels && height_px <= kMaxPicturePixels &&
         width_px * height_px <= kMaxPicturePixels;
}

void check_picture_size(const std::filesystem::path& path, std::int64_t width_px, std::int64_t height_px) {
  if (!fits_any_sensor(width_px, height_px))
    throw Error(path.string() + ": " + size_text(width_px, height_px) +
                " pixels are more than any touch sensor has");
}

PictureFit picture_fit(std::int64_t width_px, std::int64_t height_px, const SensorProfile& profile) {
  if (width_px == profile.width_px && height_px == profile.height_px) return PictureFit::as_it_is;
  if (width_px == profile.raw_width_px && height_px == profile.raw_height_px) return PictureFit::crop;
  return profile.cropped && may_be_enlarged(width_px, height_px, profile) ? PictureFit::resize
                                                                          : PictureFit::never;
}

std::string wrong_size_text(std::int64_t width_px, std::int64_t height_px, const SensorProfile& profile) {
  std::string text = "is " + size_text(width_px, height_px) + " pixels; " + profile.device_name + " needs " +
                     size_text(profile.width_px, profile.height_px) + ", or the camera's raw image (" +
                     size_text(profile.raw_width_px, profile.raw_height_px) + ")";
  if ((width_px < height_px) != (profile.width_px < profile.height_px))
    return text + "; is it turned by 90 degrees, or another sensor's?";
  const double enlarged = static_cast<double>(profile.width_px) / static_cast<double>(width_px);
  if (enlarged > 1)
    return text + fmt::format(
                      "; for pictures as small as these write in a configuration \"imgw: {}\", "
                      "\"imgh: {}\", a \"ppmm\" {:.3g} times the usual one, their \"framerate\", and "
                      "\"color_gain_blue\", \"_green\" and \"_red\" if "
                      "the model is another sensor's, as configs/clip.yaml does",
                      width_px, height_px, enlarged);
  text += "; write in device_config of a configuration \"raw_imgw: " + std::to_string(width_px) +
          "\" and \"raw_imgh: " + std::to_string(height_px) + "\" where it is the camera's whole picture";
  return may_be_enlarged(width_px, height_px, profile)
             ? text + ", or \"cropped: true\" where it was cropped already"
             : text;
}

cv::Rect kept_window(cv::Size raw, const SensorProfile& profile) {
  const PictureFit fit = picture_fit(raw.width, raw.height, profile);
  if (fit == PictureFit::as_it_is) return {{}, raw};
  const bool cut_border = fit == PictureFit::crop;
  const int border_x = cut_border ? raw.width / 7 : 0, border_y = cut_border ? raw.height / 7 : 0;
  cv::Rect window(border_x, border_y, raw.width - 2 * border_x, raw.height - 2 * border_y);
  const double aspect = static_cast<double>(profile.width_px) / profile.height_px;
  const int extra_rows = std::max(0, static_cast<int>(window.height - window.width / aspect));
  const int extra_columns = std::max(0, static_cast<int>(window.width - window.height * aspect));
  window.x += (extra_columns + 1) / 2;
  window.y += (extra_rows + 1) / 2;
  window.width = std::max(1, window.width - extra_columns);
  window.height = std::max(1, window.height - extra_rows);
  return window;
}

cv::Mat3b area_resample(const cv::Mat3b& image, const cv::Rect2d& window, cv::Size size) {
  const auto rows = footprints(window.y, window.height, size.height, image.rows);
  const auto columns = footprints(window.x, window.width, size.width, image.cols);
  cv::Mat3b result(size);
  std::vector<float> sum(3 * static_cast<std::size_t>(image.cols));
  for (int v = 0; v < size.height; ++v) {
    average_rows(image, rows[static_cast<std::size_t>(v)], sum);
    average_columns(sum, columns, result[v]);
  }
  return result;
}

}  // namespace gelslam::detail
