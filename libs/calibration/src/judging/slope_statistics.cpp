// Compares read slopes with those of a pressed ball, pixel by pixel. To separate the gradient scale from
// errors of the circle, the ball is first shifted until its slopes agree in the mean with the read ones.

#include "gelslam/calibration/slope_statistics.hpp"

#include <cmath>

#include "gelslam/core/se3.hpp"
#include "gelslam/surface/slopes.hpp"

namespace gelslam {
namespace {

/// Returns the ball shifted so that its slopes agree in the mean with those that the model reads. The slope
/// angle of a ball changes by about 1 rad over its radius, so the mean difference of the angles times the
/// radius is the shift. As this holds to first order only, it is repeated.
SeenBall ball_as_read(const std::vector<ZoneReading>& pixels, const std::vector<Eigen::Vector2d>& rest_mm,
                      SeenBall ball, double diameter_mm) {
  const double ball_px = 0.5 * diameter_mm / ball.camera().pitch_mm;
  for (int iteration = 0; iteration < 5 && !pixels.empty(); ++iteration) {
    double du = 0.0, dv = 0.0;
    for (std::size_t k = 0; k < pixels.size(); ++k) {
      const auto truth = ball.slope(rest_mm[k]);
      du += std::atan(pixels[k].read[0]) - std::atan(truth[0]);
      dv += std::atan(pixels[k].read[1]) - std::atan(truth[1]);
    }
    BallZone zone = ball.zone();
    zone.u_px -= du / static_cast<double>(pixels.size()) * ball_px;
    zone.v_px -= dv / static_cast<double>(pixels.size()) * ball_px;
    ball = SeenBall(ball.camera(), zone, diameter_mm);
  }
  return ball;
}

}  // namespace

std::vector<ZoneReading> read_zone(const GradientModel& model, const PressSet& set, const BallZone& zone,
                                   double pixel_pitch_mm) {
  const CalibrationPress& press = set.presses[zone.press];
  const SeenBall ball(set.camera(pixel_pitch_mm), zone, press.diameter_mm);
  const SlopeMap map = read_slope_map(model, press.bgr, set.background);
  std::vector<ZoneReading> pixels;
  std::vector<Eigen::Vector2d> places_mm;
  for_each_pixel(ball, press, [&](int u, int v, const Eigen::Vector2d& rest_mm) {
    pixels.push_back({u,
                      v,
                      {static_cast<double>(map.gx(v, u)), static_cast<double>(map.gy(v, u))},
                      ball.slope(rest_mm),
                      {}});
    places_mm.push_back(rest_mm);
  });
  const SeenBall as_read = ball_as_read(pixels, places_mm, ball, press.diameter_mm);
  for (std::size_t k = 0; k < pixels.size(); ++k) pixels[k].truth = as_read.slope(places_mm[k]);
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

void SlopeStatistics::add(const ZoneReading& pixel, const cv::Size& picture) {
  all.add(pixel);
  const int row = 3 * pixel.v / picture.height, column = 3 * pixel.u / picture.width;
  ninths[static_cast<std::size_t>(3 * row + column)].add(pixel);
}

}  // namespace gelslam
