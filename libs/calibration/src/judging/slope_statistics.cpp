#include "gelslam/calibration/slope_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "gelslam/surface/slopes.hpp"

namespace gelslam {
namespace {

std::vector<ZoneReading> readings_of(const SlopeMap& map, const BallZone& zone,
                                     const CalibrationPress& press) {
  std::vector<ZoneReading> pixels;
  for (int v = 0; v < map.gx.rows; ++v)
    for (int u = 0; u < map.gx.cols; ++u)
      if (std::hypot(u - zone.u_px, v - zone.v_px) <= zone.radius_px && press.shows_gel(u, v))
        pixels.push_back({u, v, {static_cast<double>(map.gx(v, u)), static_cast<double>(map.gy(v, u))}, {}});
  return pixels;
}

std::array<double, 2> ball_slope(double du, double dv, double ball_px) {
  const double down = std::sqrt(std::max(1e-6, ball_px * ball_px - du * du - dv * dv));
  return {du / down, dv / down};
}

/// Where the read slopes say the center is: the shift by which they agree with the ball in the mean.
void recenter(const std::vector<ZoneReading>& pixels, double ball_px, BallZone& zone) {
  for (int iteration = 0; iteration < 5 && !pixels.empty(); ++iteration) {
    double du = 0.0, dv = 0.0;
    for (const ZoneReading& pixel : pixels) {
      const auto truth = ball_slope(pixel.u - zone.u_px, pixel.v - zone.v_px, ball_px);
      du += std::atan(pixel.read[0]) - std::atan(truth[0]);
      dv += std::atan(pixel.read[1]) - std::atan(truth[1]);
    }
    zone.u_px -= du / static_cast<double>(pixels.size()) * ball_px;
    zone.v_px -= dv / static_cast<double>(pixels.size()) * ball_px;
  }
}

}  // namespace

void SlopeSums::add(const std::array<double, 2>& read, const std::array<double, 2>& truth, double sigma_rad) {
  constexpr double degrees = 180.0 / std::numbers::pi;
  const double error_x = degrees * (std::atan(read[0]) - std::atan(truth[0])),
               error_y = degrees * (std::atan(read[1]) - std::atan(truth[1]));
  for (std::size_t axis = 0; axis < 2; ++axis) {
    read_true[axis] += read[axis] * truth[axis];
    true_true[axis] += truth[axis] * truth[axis];
  }
  abs_error_deg += std::abs(error_x) + std::abs(error_y);
  const double sigma_deg = degrees * sigma_rad;
  squared_z += (error_x * error_x + error_y * error_y) / (sigma_deg * sigma_deg);
  pixels += 1.0;
}

void SlopeSums::add(const SlopeSums& other) {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    read_true[axis] += other.read_true[axis];
    true_true[axis] += other.true_true[axis];
  }
  abs_error_deg += other.abs_error_deg;
  squared_z += other.squared_z;
  pixels += other.pixels;
}

void SlopeStatistics::add(const SlopeStatistics& other) {
  all.add(other.all);
  for (std::size_t k = 0; k < ninths.size(); ++k) ninths[k].add(other.ninths[k]);
  for (std::size_t k = 0; k < by_slope.size(); ++k) by_slope[k].add(other.by_slope[k]);
}

std::vector<ZoneReading> read_zone(const GradientModel& model, const PressSet& set, const BallZone& zone,
                                   double pixel_pitch_mm, bool recentered) {
  const CalibrationPress& press = set.presses[zone.press];
  const double ball_px = 0.5 * press.diameter_mm / pixel_pitch_mm;
  std::vector<ZoneReading> pixels =
      readings_of(read_slope_map(model, press.bgr, set.background), zone, press);
  BallZone center = zone;
  if (recentered) recenter(pixels, ball_px, center);
  cv::Mat1f sigma;
  cv::resize(uncertainty_of(model, press.bgr.size(), pixel_pitch_mm).sigma_rad, sigma, press.bgr.size());
  for (ZoneReading& pixel : pixels) {
    pixel.truth = ball_slope(pixel.u - center.u_px, pixel.v - center.v_px, ball_px);
    pixel.sigma_rad = static_cast<double>(sigma(pixel.v, pixel.u));
  }
  return pixels;
}

SlopeStatistics statistics_of(const std::vector<ZoneReading>& pixels, const cv::Size& picture) {
  SlopeStatistics statistics;
  constexpr auto& limits = SlopeStatistics::kSlopeLimits;
  for (const ZoneReading& pixel : pixels) {
    const auto ninth =
        static_cast<std::size_t>(3 * (3 * pixel.v / picture.height) + 3 * pixel.u / picture.width);
    statistics.all.add(pixel.read, pixel.truth, pixel.sigma_rad);
    statistics.ninths[ninth].add(pixel.read, pixel.truth, pixel.sigma_rad);
    const auto limit =
        std::lower_bound(limits.begin(), limits.end(), std::hypot(pixel.truth[0], pixel.truth[1]));
    if (limit != limits.end())
      statistics.by_slope[static_cast<std::size_t>(limit - limits.begin())].add(pixel.read, pixel.truth,
                                                                                pixel.sigma_rad);
  }
  return statistics;
}

}  // namespace gelslam
