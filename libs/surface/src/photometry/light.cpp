#include "photometry/light.hpp"

#include <algorithm>
#include <cmath>

namespace gelslam::surface::detail {
namespace {

double row_gain_at(const std::vector<double>& rows, double y) {
  const double place = (y + 1.0) / 2.0 * static_cast<double>(rows.size() - 1);
  const auto above = std::min(static_cast<std::size_t>(place), rows.size() - 1),
             below = std::min(above + 1, rows.size() - 1);
  return std::lerp(rows[above], rows[below], place - static_cast<double>(above));
}

/// A channel's value without the field.
double without_field(const Light& light, std::size_t channel, double seen, double x, double y) {
  if (light.unevenness == Unevenness::banded) return seen / row_gain_at(light.row_gain, y);
  const double field = field_at(light.field[channel], x, y);
  if (light.unevenness == Unevenness::added) return seen - field;
  const double gain = light.gain[channel], offset = light.offset[channel];
  return offset + (seen - offset) * gain / std::max(least_gain / 2, gain + field / 128.0);
}

template <typename Pixel>
void remove_field_from(const Light& light, const cv::Mat_<Pixel>& from, cv::Mat_<Pixel>& to) {
  to.create(from.size());
  for (int v = 0; v < from.rows; ++v) {
    const double y = unit_place(v, from.rows);
    for (int u = 0; u < from.cols; ++u) {
      const double x = unit_place(u, from.cols);
      for (std::size_t c = 0; c < 3; ++c) {
        const int channel = static_cast<int>(c);
        to(v, u)[channel] =
            cv::saturate_cast<typename Pixel::value_type>(without_field(light, c, from(v, u)[channel], x, y));
      }
    }
  }
}

}  // namespace

ColorTable color_table(const Light& light) {
  ColorTable table;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t value = 0; value < 256; ++value) {
      table[c][value] = static_cast<float>((static_cast<double>(value) - light.offset[c]) / light.gain[c]);
    }
  }
  return table;
}

void remove_field(const Light& light, const cv::Mat3b& bgr, cv::Mat3b& even) {
  remove_field_from(light, bgr, even);
}
void remove_field(const Light& light, cv::Mat3f& means) { remove_field_from(light, means, means); }

void to_background_light(const Light& light, cv::Mat3f& means) {
  for (cv::Vec3f& mean : means) {
    for (std::size_t c = 0; c < 3; ++c) {
      float& value = mean[static_cast<int>(c)];
      value = static_cast<float>((static_cast<double>(value) - light.offset[c]) / light.gain[c]);
    }
  }
}

}  // namespace gelslam::surface::detail
