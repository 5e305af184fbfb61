#include "gelslam/calibration/press_coverage.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "gelslam/calibration/slope_statistics.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/core/se3.hpp"

namespace gelslam {
namespace {

// Slopes of 17 and 31 degrees. The median press of three real sets, and of four simulated sets of mixed
// depths, has 0.35 to 0.55.
constexpr double kShallowRim = 0.3, kDeepRim = 0.6;
constexpr double kMaxPressesShare = 0.9;  // Quantile of the presses.

double degrees(double slope) { return std::atan(slope) * kDegreesPerRadian; }

}  // namespace

PressCoverage::PressCoverage(const cv::Size& picture, int wanted)
    : picture_(picture), wanted_(std::max(wanted, kMinPresses)) {}

std::size_t PressCoverage::zone_of(const ContactCircle& circle) const {
  const auto third = [](double place_px, int size_px) {
    return std::clamp(static_cast<int>(kSide * (place_px + 0.5) / size_px), 0, kSide - 1);
  };
  return static_cast<std::size_t>(kSide * third(circle.v_px, picture_.height) +
                                  third(circle.u_px, picture_.width));
}

void PressCoverage::add(const ContactCircle& circle) { ++taken_[zone_of(circle)]; }

int PressCoverage::total() const { return std::accumulate(taken_.begin(), taken_.end(), 0); }

int PressCoverage::missing(std::size_t zone) const {
  return std::max(0, wanted_ / (kSide * kSide) - taken_[zone]);
}

bool PressCoverage::enough() const { return total() >= wanted_ && gaps().empty(); }

std::string PressCoverage::advice() const {
  if (enough()) return "enough presses, all over the gel";
  std::size_t barest = 0;
  for (std::size_t zone = 1; zone < taken_.size(); ++zone)
    if (missing(zone) > missing(barest)) barest = zone;
  if (missing(barest) > 0)
    return std::string("press at the ") + press_zone_name(barest) + " (" + std::to_string(missing(barest)) +
           " more there)";
  return "press anywhere (" + std::to_string(wanted_ - total()) + " more)";
}

std::string PressCoverage::gaps() const {
  std::string text;
  for (std::size_t zone = 0; zone < taken_.size(); ++zone)
    if (missing(zone) > 0)
      text += (text.empty() ? "" : ", ") + std::string(press_zone_name(zone)) + " (" +
              std::to_string(missing(zone)) + ")";
  return text;
}

const char* press_zone_name(std::size_t zone) {
  constexpr std::array<const char*, 9> names = {
      "upper left", "top", "upper right", "left", "middle", "right", "lower left", "bottom", "lower right"};
  return names.at(zone);
}

double rim_slope(double radius_px, double ball_px) {
  const double radius = std::clamp(radius_px, 0.0, 0.99 * ball_px);
  return radius / std::sqrt(ball_px * ball_px - radius * radius);
}

std::string missing_depths(const std::vector<double>& rim_slopes) {
  if (rim_slopes.empty()) return "";
  if (quantile(rim_slopes, kMaxPressesShare) < kShallowRim)
    return fmt::format(
        "the presses show hardly any slope above {:.0f} degrees, and what a model reads there is not known: "
        "press deeper",
        degrees(kShallowRim));
  if (quantile(rim_slopes, 1.0 - kMaxPressesShare) > kDeepRim)
    return fmt::format(
        "hardly any press is less deep than {:.0f} degrees at its rim, and what a model reads in lighter "
        "touches is "
        "not known: press some less deep",
        degrees(kDeepRim));
  return "";
}

}  // namespace gelslam
