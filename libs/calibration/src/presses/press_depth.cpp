#include "gelslam/calibration/press_depth.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "gelslam/core/median.hpp"
#include "gelslam/core/se3.hpp"

namespace gelslam {
namespace {

// 17 and 31 degrees. The middle press of three real sets and of four simulated ones of all depths: 0.35 to
// 0.55.
constexpr double kShallowRim = 0.3, kDeepRim = 0.6;
constexpr double kMostPressesShare = 0.9;  // of the presses

double degrees(double slope) { return std::atan(slope) * kDegreesPerRadian; }

}  // namespace

double rim_slope(double radius_px, double ball_px) {
  const double inside = std::clamp(radius_px, 0.0, 0.99 * ball_px);
  return inside / std::sqrt(ball_px * ball_px - inside * inside);
}

std::string missing_depths(const std::vector<double>& rim_slopes) {
  if (rim_slopes.empty()) return "";
  if (quantile(rim_slopes, kMostPressesShare) < kShallowRim)
    return fmt::format(
        "the presses show hardly any slope above {:.0f} degrees, and what a model reads there is not known: "
        "press deeper",
        degrees(kShallowRim));
  if (quantile(rim_slopes, 1.0 - kMostPressesShare) > kDeepRim)
    return fmt::format(
        "hardly any press is less deep than {:.0f} degrees at its rim, and what a model reads in lighter "
        "touches is "
        "not known: press some less deep",
        degrees(kDeepRim));
  return "";
}

}  // namespace gelslam
