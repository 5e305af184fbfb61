#include <algorithm>
#include <array>
#include <cmath>

#include "gelslam/calibration/pixel_pitch.hpp"
#include "gelslam/core/median.hpp"
#include "presses/press_fit.hpp"

namespace gelslam {
namespace {

using namespace calibration::detail;

constexpr std::size_t kMinAspectPresses = 5;
constexpr double kWantedAspectPoints = 900;
constexpr double kWholeRadii = 1.3;   // of the zone: contact and rim lie in the picture
constexpr double kAspectStep = 0.03;  // between the aspects that are tried
constexpr int kMaxAspectSteps = 8;    // steps from 1: a quarter

/// A press as it would look with as many millimeters per pixel down as across.
PressPoints stretched_down(PressPoints points, double aspect) {
  for (double& v : points.v_px) v *= aspect;
  return points;
}

/// What a ball leaves unexplained of a press when pixels are `aspect` times as high as wide.
class AspectCost {
 public:
  AspectCost(const PressPoints& points, const BallZone& zone, double ball_px)
      : points_(points), zone_(zone), ball_px_(ball_px) {}

  double operator()(double aspect) const {
    const PressShape start{zone_.u_px, zone_.v_px * aspect, zone_.radius_px, 8.0};
    return refine_press(stretched_down(points_, aspect), start, ball_px_).cost;
  }

 private:
  const PressPoints& points_;
  const BallZone& zone_;
  double ball_px_;
};

/// Downhill in steps from 1, then the lowest point of the parabola there. Nothing at the end of the range.
std::optional<double> best_aspect(const AspectCost& cost) {
  const auto aspect_of = [](int steps) { return 1.0 + kAspectStep * steps; };
  int at = 0;
  std::array<double, 3> costs = {cost(aspect_of(-1)), cost(aspect_of(0)), cost(aspect_of(1))};
  while (costs[1] > std::min(costs[0], costs[2])) {
    const int direction = costs[0] < costs[2] ? -1 : 1;
    at += direction;
    if (std::abs(at) >= kMaxAspectSteps) return std::nullopt;
    const double next = cost(aspect_of(at + direction));
    costs = direction < 0 ? std::array{next, costs[0], costs[1]} : std::array{costs[1], costs[2], next};
  }
  const double bend = costs[0] - 2.0 * costs[1] + costs[2];
  if (!(bend > 0.0)) return std::nullopt;
  return aspect_of(at) + 0.5 * kAspectStep * (costs[0] - costs[2]) / bend;
}

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
    const cv::Mat3f relative = relative_change(press_change(press.bgr, set.background), set.background);
    const PressPoints points =
        points_around({zone.u_px, zone.v_px, zone.radius_px}, relative, kWantedAspectPoints);
    const AspectCost cost(points, zone, 0.5 * press.diameter_mm / pixel_pitch_mm);
    if (const auto aspect = best_aspect(cost)) aspects.push_back(*aspect);
  }
  if (aspects.size() < kMinAspectPresses) return std::nullopt;
  PixelAspect result{median(aspects), 0.0, aspects.size()};
  std::vector<double> distances;
  for (const double aspect : aspects) distances.push_back(std::abs(aspect - result.y_over_x));
  constexpr double deviation_per_median = 1.48, of_a_median = 1.25;  // of normal errors
  result.uncertainty =
      of_a_median * deviation_per_median * median(distances) / std::sqrt(static_cast<double>(aspects.size()));
  return result;
}

}  // namespace gelslam
