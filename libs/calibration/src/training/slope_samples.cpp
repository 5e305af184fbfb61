#include <algorithm>
#include <cmath>

#include "training/color_field.hpp"

namespace gelslam::calibration::detail {
namespace {

SlopeSample sample_at(const cv::Mat3b& bgr, const cv::Mat3b& background, int u, int v) {
  SlopeSample sample;
  for (int channel = 0; channel < 3; ++channel) {
    const auto c = static_cast<std::size_t>(channel);
    sample.color[c] = static_cast<float>(bgr(v, u)[channel]) / 255.0F;
    sample.flat_color[c] = static_cast<float>(background(v, u)[channel]) / 255.0F;
  }
  sample.place = {static_cast<float>(u) / static_cast<float>(bgr.cols),
                  static_cast<float>(v) / static_cast<float>(bgr.rows)};
  sample.u_px = u;
  sample.v_px = v;
  return sample;
}

}  // namespace

std::vector<SlopeSample> zone_samples(const PressSet& set, const std::vector<BallZone>& zones,
                                      double pixel_pitch_mm, int wanted) {
  double area = 0.0;
  for (const BallZone& zone : zones) area += 3.1416 * zone.radius_px * zone.radius_px;
  // Every pixel when there are few; else those whose number, along the picture, falls on the grid.
  const int every = std::max(1, static_cast<int>(area / wanted));
  std::vector<SlopeSample> samples;
  int number = 0;
  for (std::size_t k = 0; k < zones.size(); ++k) {
    const BallZone& zone = zones[k];
    const CalibrationPress& press = set.presses[zone.press];
    const SeenBall ball(set.camera(pixel_pitch_mm), zone, press.diameter_mm);
    for_each_pixel(ball, press, [&](int u, int v, const Eigen::Vector2d& rest_mm) {
      if (number++ % every != 0) return;
      SlopeSample sample = sample_at(press.bgr, set.background, u, v);
      const auto slope = ball.slope(rest_mm);
      for (std::size_t axis = 0; axis < 2; ++axis)
        sample.angle_rad[axis] = static_cast<float>(std::atan(slope[axis]));
      sample.zone = static_cast<int>(k);
      samples.push_back(sample);
    });
  }
  return samples;
}

}  // namespace gelslam::calibration::detail
