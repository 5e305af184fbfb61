#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace gelslam::surface::detail {

/// Stray light from one side adds to the picture, a lamp that fails on one side dims it, one that flickers
/// dims some rows.
enum class Unevenness { none, added, multiplied, banded };

using Gains = std::array<double, 3>;

/// How the lamps and stray light differ from when the background was taken: per channel, seen = gain * then +
/// offset, and + field (added) or + field * then / 128 (multiplied), or all that times row_gain (banded).
/// Untouched gel keeps its color otherwise, so all follow from the untouched part of one frame.
struct Light {
  Gains gain{1.0, 1.0, 1.0};
  std::array<double, 3> offset{0.0, 0.0, 0.0};  ///< gray levels
  /// Gray levels times x, y, x², xy, y²; x and y go from -1 to 1 over the picture.
  std::array<std::array<double, 5>, 3> field{};
  std::vector<double> row_gain{};            ///< of each row of blocks; the same for all channels
  Unevenness unevenness = Unevenness::none;  ///< none: no field and no rows
};

/// For each channel and 8-bit value the gray level it would have had in the background's light, but for the
/// field.
using ColorTable = std::array<std::array<float, 256>, 3>;
ColorTable color_table(const Light& light);

/// A picture, or mean colors of its blocks, as they were without the field.
void remove_field(const Light& light, const cv::Mat3b& bgr, cv::Mat3b& even);
void remove_field(const Light& light, cv::Mat3f& means);

/// Mean colors as they would have been in the background's light, but for the field, in place.
void to_background_light(const Light& light, cv::Mat3f& means);

/// From -1 to 1 over the picture.
inline double unit_place(int index, int count) { return count < 2 ? 0.0 : 2.0 * index / (count - 1) - 1.0; }

inline double field_at(const std::array<double, 5>& field, double x, double y) {
  return field[0] * x + field[1] * y + field[2] * x * x + field[3] * x * y + field[4] * y * y;
}

/// What the field makes of a color, relative to the background, in each of the two ways.
inline double field_scale(Unevenness unevenness, double then) {
  return unevenness == Unevenness::multiplied ? then / 128.0 : 1.0;
}

// A lamp so weak tells no slopes; a gain so large is none of the lamps'.
inline constexpr double least_gain = 0.2, largest_gain = 3.0;

}  // namespace gelslam::surface::detail
