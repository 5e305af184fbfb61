#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <random>

#include "../support/analytic_surface.hpp"
#include "../support/pixel_map.hpp"
#include "gelslam/surface/gradient_model.hpp"

namespace gelslam::test {

inline const cv::Size kSensor(320, 240);

/// The color of the simulated gel: red is linear in the slope angle along x, and green in that along y, by
/// 0.0065 rad per gray level (about that of a GelSight Mini). Blue does not depend on the slope.
inline constexpr double kRadPerLevel = 0.0065;
inline constexpr double kBareLevel = 110.0;

/// Returns the network that reads the slopes of this gel exactly. Pairs of ReLUs carry the positive and the
/// negative part of a slope through all layers.
inline GradientModel linear_gel_model() {
  GradientModel model;
  const auto weight = [&](std::size_t layer, int out, int in) -> float& {
    return model.weight(layer)[static_cast<std::size_t>(out * GradientModel::kShape.sizes[layer] + in)];
  };
  for (int axis = 0; axis < 2; ++axis) {
    for (int part = 0; part < 2; ++part) {
      const int unit = 2 * axis + part;
      const double sign = part == 0 ? 1.0 : -1.0;
      weight(0, unit, axis == 0 ? 2 : 1) = static_cast<float>(sign * kRadPerLevel * 255.0);
      model.bias(0)[static_cast<std::size_t>(unit)] = static_cast<float>(-sign * kRadPerLevel * kBareLevel);
      weight(1, unit, unit) = 1.0F;
      weight(2, unit, unit) = 1.0F;
      weight(3, axis, unit) = static_cast<float>(sign);
    }
  }
  return model;
}

/// Returns the picture of a height map (mm), with white noise of `noise_levels` gray levels. Blue varies over
/// the gel, so that a gain of the light can be distinguished from an offset, as on a real gel.
inline cv::Mat3b render(const cv::Mat1f& height_mm, double pitch_mm, double noise_levels,
                        std::uint64_t seed) {
  std::mt19937_64 random(seed);
  cv::Mat3b image(height_mm.size());
  const auto at = [&](int v, int u) {
    return static_cast<double>(height_mm(std::clamp(v, 0, image.rows - 1), std::clamp(u, 0, image.cols - 1)));
  };
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const double gx = (at(v, u + 1) - at(v, u - 1)) / (2 * pitch_mm),
                   gy = (at(v + 1, u) - at(v - 1, u)) / (2 * pitch_mm);
      const double levels[] = {60.0 + 80.0 * u / image.cols, kBareLevel + std::atan(gy) / kRadPerLevel,
                               kBareLevel + std::atan(gx) / kRadPerLevel};
      for (int c = 0; c < 3; ++c) {
        image(v, u)[c] = cv::saturate_cast<unsigned char>(levels[c] + noise_levels * normal_deviate(random));
      }
    }
  }
  return image;
}

/// Returns the heights (mm) of a gel into which a ball is pressed `depth_mm` deep at the pixel (u, v). Inside
/// the circle of the contact they are those of the ball; outside, a draped rim begins with the slope of the
/// ball and ends after about 1 mm.
inline cv::Mat1f ball_press(cv::Size size, double pitch_mm, double u, double v, double radius_mm,
                            double depth_mm) {
  const double edge_depth_mm = 0.35 * depth_mm;  // where the gel leaves the ball
  const double edge_mm =
      std::sqrt(2 * radius_mm * (depth_mm - edge_depth_mm) - std::pow(depth_mm - edge_depth_mm, 2));
  const double edge_slope = edge_mm / std::sqrt(radius_mm * radius_mm - edge_mm * edge_mm);
  const double fade_mm = edge_depth_mm / edge_slope;
  return pixel_map<float>(size, [=](int column, int row) {
    const double r = pitch_mm * std::hypot(column - u, row - v);
    return r < edge_mm ? radius_mm - depth_mm - std::sqrt(radius_mm * radius_mm - r * r)
                       : -edge_depth_mm * std::exp(-(r - edge_mm) / fade_mm);
  });
}

/// The heights of a gel that nothing touches, and its picture.
inline const cv::Mat1f kFlatGel(kSensor, 0.0F);
inline cv::Mat3b bare_picture(double noise_levels, std::uint64_t seed) {
  return render(kFlatGel, kPitchMm, noise_levels, seed);
}

/// Returns the picture with the brightness of each pixel multiplied by `shade`.
inline cv::Mat3b shaded(const cv::Mat3b& image, const cv::Mat1f& shade) {
  return pixel_map<cv::Vec3b>(image.size(),
                              [&](int u, int v) { return image(v, u) * static_cast<double>(shade(v, u)); });
}

/// Returns the radius in pixels of the circle of the contact in ball_press().
inline double contact_radius_px(double pitch_mm, double radius_mm, double depth_mm) {
  const double depth = 0.65 * depth_mm;
  return std::sqrt(2 * radius_mm * depth - depth * depth) / pitch_mm;
}

}  // namespace gelslam::test
