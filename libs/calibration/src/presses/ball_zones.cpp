#include "gelslam/calibration/ball_zones.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>

#include "gelslam/calibration/circle_finder.hpp"
#include "gelslam/calibration/press_coverage.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"

namespace gelslam {
namespace {

constexpr double kZoneMarginPx = 3.0;  // the gel's bend at the rim, seen through the lens
constexpr double kMinZonePx = 5.0;
constexpr std::size_t kMinCompared = 5;  // labels, to tell how they were drawn
constexpr double kCloseCenters = 0.12;   // of the radius: a label and what is found mean the same
constexpr double kBesideRadii = 0.6;     // of the radius: a label that misses its contact
constexpr std::size_t kMinPresses = 10;
constexpr double kMaxBackgroundLevels = 8.0;
constexpr double kMaxInAnotherLight = 0.25;  // of the presses: more are no accident
constexpr double kUntouchedRadii = 2.5;

double spread(std::vector<double> values, double middle) {
  for (double& value : values) value = std::abs(value - middle);
  return median(std::move(values));
}

/// How a set's labels were drawn: the gel leaves the ball at radius * ratio - offset.
struct LabelStyle {
  double ratio = 1.0, offset_px = kVisibleRimPx;
  double ball_radius_px(const ContactCircle& label) const { return ratio * label.radius_px - offset_px; }
};

double distance_px(const ContactCircle& a, const ContactCircle& b) {
  return std::hypot(a.u_px - b.u_px, a.v_px - b.v_px);
}

/// A circle that was found and accepted as it was: it says no more than the picture does, from which the ball
/// itself is known better.
bool is_as_found(const ContactCircle& label, const FoundCircle& found) {
  constexpr double same_px = 0.01;
  return found.problem.empty() && distance_px(label, found.circle) < same_px &&
         std::abs(label.radius_px - found.circle.radius_px) < same_px;
}

LabelStyle style_of_labels(const PressSet& set, const std::vector<FoundCircle>& found) {
  std::vector<double> ratios, offsets;
  for (std::size_t k = 0; k < found.size(); ++k) {
    const auto& label = set.presses[k].label;
    if (!label || set.presses[k].left_out || !found[k].problem.empty() || is_as_found(*label, found[k]))
      continue;
    if (distance_px(*label, found[k].circle) > kCloseCenters * label->radius_px) continue;
    ratios.push_back(found[k].ball.radius_px / label->radius_px);
    offsets.push_back(label->radius_px - found[k].ball.radius_px);
  }
  if (ratios.size() < kMinCompared) return {};
  const double ratio = median(ratios), offset = median(offsets);
  std::vector<double> ratio_errors;
  for (std::size_t k = 0; k < ratios.size(); ++k)
    ratio_errors.push_back((ratios[k] - ratio) * offsets[k] / std::max(0.05, 1.0 - ratios[k]));
  if (spread(ratio_errors, 0.0) < spread(offsets, offset)) return {std::min(1.0, ratio), 0.0};
  return {1.0, std::max(0.0, offset)};
}

/// Why a label cannot be right, or nothing.
std::string problem_with_label(const CalibrationPress& press, const FoundCircle& found,
                               double ball_radius_px) {
  const ContactCircle& label = *press.label;
  if (label.u_px < -label.radius_px || label.v_px < -label.radius_px ||
      label.u_px > press.bgr.cols + label.radius_px || label.v_px > press.bgr.rows + label.radius_px)
    return "its label lies outside the picture";
  if (found.problem.empty() &&
      distance_px(label, found.circle) > kBesideRadii * std::max(label.radius_px, found.circle.radius_px))
    return "its label lies beside the contact";
  if (label.radius_px > 1.45 * ball_radius_px)
    return "its label is larger than the ball: is the diameter right?";
  return "";
}

/// Median difference to the background far from the contact, gray levels.
double background_difference(const PressSet& set, const BallZone& zone) {
  const cv::Mat3b& bgr = set.presses[zone.press].bgr;
  std::vector<double> differences;
  constexpr int stride = 4;
  for (int v = 0; v < bgr.rows; v += stride)
    for (int u = 0; u < bgr.cols; u += stride) {
      if (std::hypot(u - zone.u_px, v - zone.v_px) < kUntouchedRadii * (zone.radius_px + kZoneMarginPx))
        continue;
      differences.push_back(cv::norm(cv::Vec3i(bgr(v, u)) - cv::Vec3i(set.background(v, u))));
    }
  return median(differences);
}

bool is_in_another_light(const PressSet& set, const BallZone& zone) {
  return background_difference(set, zone) > kMaxBackgroundLevels;
}

/// Single pictures in another light are bad pictures; many are another sensor, and then the set is wrong.
void reject_another_light(const PressSet& set, BallZones& zones) {
  const auto strange =
      std::stable_partition(zones.zones.begin(), zones.zones.end(),
                            [&](const BallZone& zone) { return !is_in_another_light(set, zone); });
  const auto count = static_cast<double>(zones.zones.end() - strange);
  if (count <= kMaxInAnotherLight * static_cast<double>(zones.zones.size())) {
    for (auto zone = strange; zone != zones.zones.end(); ++zone)
      zones.rejected.push_back({zone->press,
                                "its untouched gel does not look like background.png: another light, gel or "
                                "sensor"});
    zones.zones.erase(strange, zones.zones.end());
  }
  std::ranges::sort(zones.zones, {}, &BallZone::press);
}

/// Two balls that overlap, something that is no ball, one press with another ball.
void reject_odd_ones(const PressSet& set, double pixel_pitch_mm, BallZones& zones) {
  const std::vector<std::size_t> odd = find_odd_zones(set, zones.zones, pixel_pitch_mm);
  for (auto k = odd.rbegin(); k != odd.rend(); ++k) {
    const auto zone = zones.zones.begin() + static_cast<std::ptrdiff_t>(*k);
    zones.rejected.push_back({zone->press,
                              "its colors are not those of the same slopes in other presses: no single ball, "
                              "or not of this diameter"});
    zones.zones.erase(zone);
  }
}

void require_one_sensor(const PressSet& set, const BallZones& zones) {
  const auto is_strange = [&](const BallZone& zone) { return is_in_another_light(set, zone); };
  const auto first = std::ranges::find_if(zones.zones, is_strange);
  if (first == zones.zones.end()) return;
  throw Error(
      "'" + set.folder.string() + "': the untouched gel of " +
      std::to_string(std::ranges::count_if(zones.zones, is_strange)) + " of " +
      std::to_string(zones.zones.size()) + " presses (first: " + set.presses[first->press].name +
      ") does not look like background.png: they come from another sensor, gel or light, or the camera "
      "has moved; keep them in folders of their own, each with its background");
}

void require_all_sides(const PressSet& set, const BallZones& zones) {
  PressCoverage coverage(set.background.size(), 1);
  for (const BallZone& zone : zones.zones) coverage.add({zone.u_px, zone.v_px, zone.radius_px});
  constexpr std::array<const char*, 3> across = {"left", "middle (between left and right)", "right"},
                                       down = {"upper", "middle (between top and bottom)", "lower"};
  const auto taken = [&](std::size_t first, std::size_t step) {
    return coverage.taken(first) + coverage.taken(first + step) + coverage.taken(first + 2 * step);
  };
  for (std::size_t k = 0; k < 3; ++k) {
    const char* bare = taken(k, 3) == 0 ? across[k] : taken(3 * k, 1) == 0 ? down[k] : nullptr;
    if (bare != nullptr)
      throw Error("'" + set.folder.string() + "': no press lies on the " + bare +
                  " third of the gel; the model could only guess there. Take presses all over the gel");
  }
}

}  // namespace

BallZones find_ball_zones(const PressSet& set, double pixel_pitch_mm, bool automatic,
                          const std::function<void(std::size_t)>& progress) {
  require_unmoved_background(set);
  std::vector<FoundCircle> found;
  for (const CalibrationPress& press : set.presses) {
    found.push_back(find_circle(press.bgr, set.background, press.ball_px(pixel_pitch_mm)));
    if (progress) progress(found.size());
  }
  const LabelStyle style = style_of_labels(set, found);
  BallZones result;
  for (std::size_t k = 0; k < set.presses.size(); ++k) {
    const CalibrationPress& press = set.presses[k];
    std::string problem;
    const ContactCircle& ball = found[k].ball;
    BallZone zone{k, ball.u_px, ball.v_px, ball.radius_px - kZoneMarginPx};
    if (press.left_out) {
      problem = "a person has left it out";
    } else if (!press.problem.empty()) {
      problem = press.problem;
    } else if (press.label && !is_as_found(*press.label, found[k])) {
      zone = {k, press.label->u_px, press.label->v_px, style.ball_radius_px(*press.label) - kZoneMarginPx};
      problem = problem_with_label(press, found[k], press.ball_px(pixel_pitch_mm));
    } else {
      problem = automatic || press.label ? found[k].problem : "it has no label";
    }
    if (problem.empty() && zone.radius_px < kMinZonePx) problem = "its contact is too small";
    if (problem.empty() && zone.radius_px > 0.95 * press.ball_px(pixel_pitch_mm))
      problem = "its contact is larger than the ball: is the diameter right?";
    if (problem.empty())
      result.zones.push_back(zone);
    else
      result.rejected.push_back({k, problem});
  }
  reject_another_light(set, result);
  reject_odd_ones(set, pixel_pitch_mm, result);
  std::ranges::sort(result.rejected, {}, &RejectedPress::press);
  return result;
}

void require_good_coverage(const PressSet& set, const BallZones& zones) {
  if (zones.zones.size() < kMinPresses) {
    std::string text = "'" + set.folder.string() + "': only " + std::to_string(zones.zones.size()) + " of " +
                       std::to_string(set.presses.size()) + " presses can be used, at least " +
                       std::to_string(kMinPresses) + " are needed (about 50 are good)";
    if (!zones.rejected.empty())
      text += "; " + set.presses[zones.rejected.front().press].name + ": " + zones.rejected.front().reason;
    throw Error(text);
  }
  require_one_sensor(set, zones);
  require_all_sides(set, zones);
}

}  // namespace gelslam
