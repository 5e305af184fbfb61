#include <cmath>

#include "gelslam/calibration/pixel_pitch.hpp"
#include "gelslam/core/median.hpp"
#include "presses/press_fit.hpp"

namespace gelslam {
namespace {

using namespace calibration::detail;

constexpr std::size_t kMinAspectPresses = 5;
constexpr double kWantedAspectPoints = 900;
constexpr double kWholeRadii = 1.3;  // of the zone: contact and rim lie in the picture
// Balls on five sensors with square pixels, rendered and real, read 0.972 to 1.026: light falls on their
// flanks from fixed sides.
constexpr double kAspectBias = 0.018;
constexpr double kAspectDecayPx = 8.0, kMaxAspectError = 0.25;

bool lies_whole_in(const BallZone& zone, const cv::Size& picture) {
  const double reach = kWholeRadii * zone.radius_px;
  return zone.u_px > reach && zone.v_px > reach && zone.u_px < picture.width - reach &&
         zone.v_px < picture.height - reach;
}

}  // namespace

std::optional<PixelAspect> aspect_from_balls(const PressSet& set, const std::vector<BallZone>& zones,
                                             double pixel_pitch_mm) {
  std::vector<double> aspects;
  for (const BallZone& zone : zones) {
    const CalibrationPress& press = set.presses[zone.press];
    if (!lies_whole_in(zone, press.bgr.size())) continue;
    const cv::Mat3f relative = relative_change(press.bgr, set.background);
    const CameraModel camera = set.camera(pixel_pitch_mm);
    const PressPoints points =
        points_around({zone.u_px, zone.v_px, zone.radius_px}, relative, camera, kWantedAspectPoints);
    const Eigen::Vector2d center_px = camera.rest_px({zone.u_px, zone.v_px});
    const double aspect =
        fit_pixel_aspect(points, {center_px.x(), center_px.y(), zone.radius_px, kAspectDecayPx},
                         press.ball_px(pixel_pitch_mm));
    if (std::abs(aspect - 1.0) < kMaxAspectError) aspects.push_back(aspect);
  }
  if (aspects.size() < kMinAspectPresses) return std::nullopt;
  PixelAspect result{median(aspects), 0.0};
  std::vector<double> distances;
  for (const double aspect : aspects) distances.push_back(std::abs(aspect - result.y_over_x));
  constexpr double deviation_per_median = 1.48, of_a_median = 1.25;  // of normal errors
  const double scatter =
      of_a_median * deviation_per_median * median(distances) / std::sqrt(static_cast<double>(aspects.size()));
  result.uncertainty = std::hypot(scatter, kAspectBias);
  return result;
}

}  // namespace gelslam
