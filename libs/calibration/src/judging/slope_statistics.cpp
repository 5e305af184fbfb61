#include "gelslam/calibration/slope_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/surface/slopes.hpp"

namespace gelslam {
namespace {

/// Where the read slopes say the center is: the shift by which they agree with the ball in the mean.
cv::Point2d center_as_read(const std::vector<ZoneReading>& pixels, double ball_px, cv::Point2d center) {
  for (int iteration = 0; iteration < 5 && !pixels.empty(); ++iteration) {
    double du = 0.0, dv = 0.0;
    for (const ZoneReading& pixel : pixels) {
      const auto truth = ball_slope(pixel.u - center.x, pixel.v - center.y, ball_px);
      du += std::atan(pixel.read[0]) - std::atan(truth[0]);
      dv += std::atan(pixel.read[1]) - std::atan(truth[1]);
    }
    center.x -= du / static_cast<double>(pixels.size()) * ball_px;
    center.y -= dv / static_cast<double>(pixels.size()) * ball_px;
  }
  return center;
}

}  // namespace

std::array<double, 2> ball_slope(double du_px, double dv_px, double ball_px) {
  const double down = std::sqrt(std::max(1e-6, ball_px * ball_px - du_px * du_px - dv_px * dv_px));
  return {du_px / down, dv_px / down};
}

std::vector<ZoneReading> read_zone(const GradientModel& model, const PressSet& set, const BallZone& zone,
                                   double pixel_pitch_mm) {
  const CalibrationPress& press = set.presses[zone.press];
  const double ball_px = press.ball_px(pixel_pitch_mm);
  const SlopeMap map = read_slope_map(model, press.bgr, set.background);
  std::vector<ZoneReading> pixels;
  for_each_pixel(zone, press, [&](int u, int v) {
    pixels.push_back({u,
                      v,
                      {static_cast<double>(map.gx(v, u)), static_cast<double>(map.gy(v, u))},
                      ball_slope(u - zone.u_px, v - zone.v_px, ball_px),
                      {}});
  });
  const cv::Point2d center = center_as_read(pixels, ball_px, {zone.u_px, zone.v_px});
  for (ZoneReading& pixel : pixels) pixel.truth = ball_slope(pixel.u - center.x, pixel.v - center.y, ball_px);
  return pixels;
}

void SlopeSums::add(const ZoneReading& pixel) {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double read = pixel.read[axis], truth = pixel.truth[axis];
    read_true[axis] += read * truth;
    true_true[axis] += truth * truth;
    abs_error_deg += kDegreesPerRadian * std::abs(std::atan(read) - std::atan(pixel.labeled[axis]));
  }
  pixels += 1.0;
}

void SlopeSums::add(const SlopeSums& other) {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    read_true[axis] += other.read_true[axis];
    true_true[axis] += other.true_true[axis];
  }
  abs_error_deg += other.abs_error_deg;
  pixels += other.pixels;
}

SlopeSums SlopeStatistics::ninth(std::size_t k) const {
  SlopeSums sums;
  for (std::size_t row = k / 3 * kRows / 3; row < (k / 3 + 1) * kRows / 3; ++row)
    for (std::size_t column = k % 3 * kColumns / 3; column < (k % 3 + 1) * kColumns / 3; ++column)
      sums.add(cells[row * kColumns + column]);
  return sums;
}

void SlopeStatistics::add(const ZoneReading& pixel, const cv::Size& picture) {
  all.add(pixel);
  const std::size_t row =
                        static_cast<std::size_t>(pixel.v) * kRows / static_cast<std::size_t>(picture.height),
                    column = static_cast<std::size_t>(pixel.u) * kColumns /
                             static_cast<std::size_t>(picture.width);
  cells[row * kColumns + column].add(pixel);
}

void SlopeStatistics::add(const SlopeStatistics& other) {
  all.add(other.all);
  for (std::size_t k = 0; k < cells.size(); ++k) cells[k].add(other.cells[k]);
}

}  // namespace gelslam
