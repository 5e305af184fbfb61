#include "gelslam/calibration/slope_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "gelslam/surface/slope_map.hpp"

namespace gelslam {
namespace {

struct ZonePixel {
  int u = 0, v = 0;
  std::array<double, 2> read{};
};

std::vector<ZonePixel> pixels_of(const SlopeMap& map, const BallZone& zone) {
  std::vector<ZonePixel> pixels;
  for (int v = 0; v < map.gx.rows; ++v)
    for (int u = 0; u < map.gx.cols; ++u)
      if (std::hypot(u - zone.u_px, v - zone.v_px) <= zone.radius_px)
        pixels.push_back({u, v, {static_cast<double>(map.gx(v, u)), static_cast<double>(map.gy(v, u))}});
  return pixels;
}

std::array<double, 2> ball_slope(double du, double dv, double ball_px) {
  const double down = std::sqrt(std::max(1e-6, ball_px * ball_px - du * du - dv * dv));
  return {du / down, dv / down};
}

/// Where the read slopes say the centre is: the shift by which they agree with the ball in the mean.
void recentre(const std::vector<ZonePixel>& pixels, double ball_px, BallZone& zone) {
  for (int iteration = 0; iteration < 5 && !pixels.empty(); ++iteration) {
    double du = 0.0, dv = 0.0;
    for (const ZonePixel& pixel : pixels) {
      const auto truth = ball_slope(pixel.u - zone.u_px, pixel.v - zone.v_px, ball_px);
      du += std::atan(pixel.read[0]) - std::atan(truth[0]);
      dv += std::atan(pixel.read[1]) - std::atan(truth[1]);
    }
    zone.u_px -= du / static_cast<double>(pixels.size()) * ball_px;
    zone.v_px -= dv / static_cast<double>(pixels.size()) * ball_px;
  }
}

}  // namespace

void SlopeSums::add(const std::array<double, 2>& read, const std::array<double, 2>& truth) {
  constexpr double degrees = 180.0 / std::numbers::pi;
  const double error_x = degrees * (std::atan(read[0]) - std::atan(truth[0])),
               error_y = degrees * (std::atan(read[1]) - std::atan(truth[1]));
  for (std::size_t axis = 0; axis < 2; ++axis) {
    read_true[axis] += read[axis] * truth[axis];
    true_true[axis] += truth[axis] * truth[axis];
  }
  abs_error_deg += std::abs(error_x) + std::abs(error_y);
  error_x_deg += error_x;
  error_y_deg += error_y;
  pixels += 1.0;
}

void SlopeSums::add(const SlopeSums& other) {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    read_true[axis] += other.read_true[axis];
    true_true[axis] += other.true_true[axis];
  }
  abs_error_deg += other.abs_error_deg;
  error_x_deg += other.error_x_deg;
  error_y_deg += other.error_y_deg;
  pixels += other.pixels;
}

void SlopeStatistics::add(const SlopeStatistics& other) {
  all.add(other.all);
  for (std::size_t k = 0; k < ninths.size(); ++k) ninths[k].add(other.ninths[k]);
  for (std::size_t k = 0; k < by_slope.size(); ++k) by_slope[k].add(other.by_slope[k]);
  for (std::size_t k = 0; k < by_rim.size(); ++k) by_rim[k].add(other.by_rim[k]);
}

SlopeStatistics measure_slopes(const GradientModel& model, const PressSet& set, const BallZone& zone,
                               double pixel_pitch_mm, bool recentred) {
  const CalibrationPress& press = set.presses[zone.press];
  const double ball_px = 0.5 * press.diameter_mm / pixel_pitch_mm;
  const std::vector<ZonePixel> pixels = pixels_of(read_slope_map(model, press.bgr, set.background), zone);
  BallZone centre = zone;
  if (recentred) recentre(pixels, ball_px, centre);
  SlopeStatistics statistics;
  for (const ZonePixel& pixel : pixels) {
    const auto truth = ball_slope(pixel.u - centre.u_px, pixel.v - centre.v_px, ball_px);
    const double steepness = std::hypot(truth[0], truth[1]);
    const auto ninth =
        static_cast<std::size_t>(3 * (3 * pixel.v / press.bgr.rows) + 3 * pixel.u / press.bgr.cols);
    statistics.all.add(pixel.read, truth);
    statistics.ninths[ninth].add(pixel.read, truth);
    const auto limit = std::lower_bound(SlopeStatistics::slope_limits.begin(),
                                        SlopeStatistics::slope_limits.end(), steepness);
    if (limit != SlopeStatistics::slope_limits.end())
      statistics.by_slope[static_cast<std::size_t>(limit - SlopeStatistics::slope_limits.begin())].add(
          pixel.read, truth);
    const double to_rim = zone.radius_px - std::hypot(pixel.u - zone.u_px, pixel.v - zone.v_px);
    const auto ring = static_cast<std::size_t>(std::max(0.0, to_rim / 2.0));
    if (ring < statistics.by_rim.size()) statistics.by_rim[ring].add(pixel.read, truth);
  }
  return statistics;
}

}  // namespace gelslam
