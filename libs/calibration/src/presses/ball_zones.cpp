// Finds the part of each press where the gel certainly touches the ball, and the slopes there (not in the
// paper).
//
// The center of a label is kept, while its radius is multiplied by a common factor: the median, over all
// labels, of the radius at which the found circle leaves the ball over that of the label. A margin for the
// gel's bend at the rim is then subtracted. SeenBall computes the slopes for a camera at a finite distance:
// the contact is symmetric about the normal of the gel at rest, and its rim is deeper than the gel at rest by
// the membrane's decay length times the slope at the rim.

#include "gelslam/calibration/ball_zones.hpp"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <opencv2/core.hpp>

#include "gelslam/calibration/circle_finder.hpp"
#include "gelslam/calibration/press_coverage.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"

namespace gelslam {

namespace {

// Beside a contact the gel's slope falls by a factor e over this length (median over real presses). The rim
// is therefore deeper than the gel at rest by its slope times this length.
constexpr double kMembraneMm = 0.5;
constexpr double kDeepestRim = 0.98;  // Relative to the ball's radius.

}  // namespace

SeenBall::SeenBall(const CameraModel& camera, const BallZone& zone, double diameter_mm)
    : camera_(camera), zone_(zone), radius_mm_(0.5 * diameter_mm) {
  const Eigen::Vector2d raw_px(zone.u_px, zone.v_px), rest_mm = camera.to_mm(camera.rectified_px(raw_px));
  const Eigen::Vector3d gel = camera.rest_point_mm(rest_mm);
  const Eigen::Vector2d slope = camera.rest_slope(gel.head<2>());
  axis_ = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
  const auto across_mm = [&](double px, double height_mm) {
    return px * rest_px_per_raw_px(camera, raw_px) * camera.pitch_mm *
           (1.0 + height_mm * camera.optics.inverse_distance());
  };
  const double contact_mm = std::min(across_mm(zone.radius_px + kZoneMarginMm / camera.pitch_mm, gel.z()),
                                     kDeepestRim * radius_mm_);
  const double down_mm = std::sqrt(radius_mm_ * radius_mm_ - contact_mm * contact_mm);
  const double rim_mm = gel.z() - contact_mm / down_mm * kMembraneMm;
  zone_mm_ = across_mm(zone.radius_px, rim_mm);
  center_mm_ = camera.point_mm(rest_mm, rim_mm) + down_mm * axis_;
}

/// Returns the vector from the ball's center to the nearer intersection of a ray with the ball, or to the
/// nearest point of the ray if it misses the ball.
Eigen::Vector3d SeenBall::from_center_mm(const Eigen::Vector2d& rest_mm) const {
  const Eigen::Vector2d sideways = camera_.optics.inverse_distance() * rest_mm;
  const Eigen::Vector3d ray(sideways.x(), sideways.y(), 1.0);
  const Eigen::Vector3d start = Eigen::Vector3d(rest_mm.x(), rest_mm.y(), 0.0) - center_mm_;
  const double along = ray.dot(start), squared = ray.squaredNorm();
  const double root = along * along - squared * (start.squaredNorm() - radius_mm_ * radius_mm_);
  return start + ray * ((-along - std::sqrt(std::max(root, 0.0))) / squared);
}

std::array<double, 2> SeenBall::slope(const Eigen::Vector2d& rest_mm) const {
  constexpr double kMinDown = 1e-5;  // Relative to the radius.
  const Eigen::Vector3d point = from_center_mm(rest_mm);
  const Eigen::Vector2d slope = point.head<2>() / std::max(-point.z(), kMinDown * radius_mm_) -
                                camera_.rest_slope(camera_.rest_point_mm(rest_mm).head<2>());
  return {slope.x(), slope.y()};
}

bool SeenBall::is_in_zone(const Eigen::Vector2d& rest_mm) const {
  const Eigen::Vector3d point = from_center_mm(rest_mm);
  return point.z() < 0 && point.cross(axis_).norm() <= zone_mm_;
}
namespace {

constexpr double kMinZonePx = 5.0;
// Least number of labels from which the convention of drawing can be estimated.
constexpr std::size_t kMinCompared = 5;
// Relative to the radius: a label and a found circle with closer centers are the same contact.
constexpr double kCloseCenters = 0.12;
// Relative to the radius: a label with a larger distance from the contact is wrong.
constexpr double kBesideRadii = 0.6;

// Relative to the ball's diameter. At most a tenth of its contacts may be wider than this; otherwise the gel
// would follow the ball to more than 53 degrees from its deepest point. Sets with right diameters (17 sizes)
// had 0.30 to 0.72; with half the diameters 0.84 to 1.45, except for balls of 12 and 15 mm that were pressed
// in by 0.5 mm only.
constexpr double kWidest = 0.8;

double distance_px(const ContactCircle& a, const ContactCircle& b) {
  return std::hypot(a.u_px - b.u_px, a.v_px - b.v_px);
}

/// True for a label that is a found circle accepted without change. It says nothing about how people draw
/// labels.
bool is_as_found(const ContactCircle& label, const FoundCircle& found) {
  constexpr double same_px = 0.01;
  return found.problem.empty() && distance_px(label, found.circle) < same_px &&
         std::abs(label.radius_px - found.circle.radius_px) < same_px;
}

/// Returns the fraction of a label's radius at which the gel leaves the ball, as a median over all labels, or
/// nothing if too few can be compared with found circles.
std::optional<double> ball_share_of_labels(const PressSet& set, const std::vector<FoundCircle>& found,
                                           double pixel_pitch_mm) {
  std::vector<double> shares;
  for (std::size_t k = 0; k < found.size(); ++k) {
    const auto& label = set.presses[k].label;
    if (!label || set.presses[k].left_out || !found[k].problem.empty() || is_as_found(*label, found[k]))
      continue;
    if (distance_px(*label, found[k].circle) <= kCloseCenters * label->radius_px)
      shares.push_back(found[k].circle.on_ball_px(pixel_pitch_mm) / label->radius_px);
  }
  return shares.size() < kMinCompared ? std::nullopt : std::optional(std::min(1.0, median(shares)));
}

/// Returns a warning if all labels are displaced from their contacts by about the same vector, as labels that
/// were drawn in differently cropped images.
std::string common_offset(const PressSet& set, const std::vector<FoundCircle>& found) {
  constexpr double kMaxPx = 3.0;  // Hand-made labels of two sensors are within 1.5.
  std::vector<double> right_px, down_px;
  for (std::size_t k = 0; k < found.size(); ++k) {
    const auto& label = set.presses[k].label;
    if (!label || set.presses[k].left_out || !found[k].problem.empty()) continue;
    right_px.push_back(label->u_px - found[k].circle.u_px);
    down_px.push_back(label->v_px - found[k].circle.v_px);
  }
  const double right = median(right_px), down = median(down_px);
  if (right_px.size() < kMinCompared || std::hypot(right, down) < kMaxPx) return "";
  return fmt::format(
      "labels lie aside of the contacts by {:+.1f} px along x and {:+.1f} px along y (median of {}): "
      "were they drawn in pictures of another crop?",
      right, down, right_px.size());
}

/// Returns why a label cannot be right, or an empty string.
std::string problem_with_label(const CalibrationPress& press, const FoundCircle& found) {
  const ContactCircle& label = *press.label;
  if (label.u_px < -label.radius_px || label.v_px < -label.radius_px ||
      label.u_px > press.bgr.cols + label.radius_px || label.v_px > press.bgr.rows + label.radius_px)
    return "its label lies outside the picture";
  if (found.problem.empty() &&
      distance_px(label, found.circle) > kBesideRadii * std::max(label.radius_px, found.circle.radius_px))
    return "its label lies beside the contact";
  return "";
}

/// Returns the width of a contact, found without using the ball's size, relative to the ball's diameter;
/// nothing if no contact is clearly visible.
std::optional<double> share_of_ball(const PressSet& set, const CalibrationPress& press,
                                    double pixel_pitch_mm) {
  if (!press.problem.empty()) return std::nullopt;
  const CameraModel camera = set.camera(pixel_pitch_mm);
  const FoundCircle found = find_circle(press.bgr, set.background, camera, kFlatterBall * press.diameter_mm);
  if (press.left_out || !found.problem.empty()) return std::nullopt;
  const Eigen::Vector2d center(found.circle.u_px, found.circle.v_px);
  return found.circle.on_ball_px(pixel_pitch_mm) * rest_px_per_raw_px(camera, center) /
         press.ball_px(pixel_pitch_mm);
}

/// Throws Error when the contacts of a ball are too wide for its diameter, which happens when the radius was
/// given as diameter.
void require_possible_widths(const PressSet& set, const std::map<double, std::vector<double>>& shares) {
  for (auto [diameter_mm, widths] : shares) {
    if (widths.size() < kMinCompared) continue;
    std::ranges::sort(widths);
    const double wide = widths[widths.size() * 9 / 10];
    if (wide > kWidest)
      throw Error(fmt::format(
          "'{}': contacts are {:.2f} times as wide as the ball of {:.2f} mm, and gel follows a "
          "ball to at most {:.2f} of its diameter: was the radius given? catalog.csv must give the diameter",
          set.folder.string(), wide, diameter_mm, kWidest));
  }
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
  std::vector<FoundCircle> found;
  std::map<double, std::vector<double>> shares;
  for (const CalibrationPress& press : set.presses) {
    found.push_back(find_circle(press.bgr, set.background, set.camera(pixel_pitch_mm), press.diameter_mm));
    if (const auto share = share_of_ball(set, press, pixel_pitch_mm))
      shares[press.diameter_mm].push_back(*share);
    if (progress) progress(found.size());
  }
  require_possible_widths(set, shares);
  const std::optional<double> drawn_share = ball_share_of_labels(set, found, pixel_pitch_mm);
  BallZones result;
  result.warning = common_offset(set, found);
  for (std::size_t k = 0; k < set.presses.size(); ++k) {
    const CalibrationPress& press = set.presses[k];
    const ContactCircle circle = press.label.value_or(found[k].circle);
    const bool was_drawn = press.label && !is_as_found(circle, found[k]);
    const double on_ball_px =
        was_drawn && drawn_share ? *drawn_share * circle.radius_px : circle.on_ball_px(pixel_pitch_mm);
    const BallZone zone{k, circle.u_px, circle.v_px, on_ball_px - kZoneMarginMm / pixel_pitch_mm};
    std::string problem;
    if (press.left_out)
      problem = "a person has left it out";
    else if (!press.problem.empty())
      problem = press.problem;
    else if (press.label)
      problem = problem_with_label(press, found[k]);
    else
      problem = automatic ? found[k].problem : "it has no label";
    if (problem.empty() && zone.radius_px < kMinZonePx) problem = "its contact is too small";
    if (problem.empty() && zone.radius_px > 0.95 * press.ball_px(pixel_pitch_mm))
      problem = "its contact is larger than the ball: is the diameter right?";
    if (problem.empty())
      result.zones.push_back(zone);
    else
      result.rejected.push_back({k, problem});
  }
  return result;
}

void require_good_coverage(const PressSet& set, const BallZones& zones) {
  if (std::ssize(zones.zones) < kMinPresses) {
    std::string text = "'" + set.folder.string() + "': only " + std::to_string(zones.zones.size()) + " of " +
                       std::to_string(set.presses.size()) + " presses can be used, at least " +
                       std::to_string(kMinPresses) + " are needed (about 50 are good)";
    if (!zones.rejected.empty())
      text += "; " + set.presses[zones.rejected.front().press].name + ": " + zones.rejected.front().reason;
    throw Error(text);
  }
  require_all_sides(set, zones);
}

}  // namespace gelslam
