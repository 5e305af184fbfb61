#include "gelslam/calibration/model_check.hpp"

#include <fmt/core.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "gelslam/calibration/press_coverage.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/surface/surface_estimator.hpp"

namespace gelslam {
namespace {

const cv::Size kCells{16, 12};

// Read from models of four sensors: a fresh good calibration stays within the first limits, one from the
// published recipe within the second.
struct Limits {
  double error_deg, scale, radius;
};
constexpr Limits kGoodLimits = {3.0, 0.03, 0.03}, kUsableLimits = {5.0, 0.10, 0.08};
constexpr double kOddNinthScale = 0.15;  // of one ninth, worth a sentence
constexpr double kMinNinthPixels = 1500;

constexpr double kMinCellPixels = 100;  // of the gradient scale's map: fewer are noise

constexpr int kMinSpherePixels = 100;
constexpr double kSphereHuberMm = 0.01;
constexpr int kMaxSphereIterations = 50;

struct FittedSphere {  // lower half: z = center_z - sqrt(radius^2 - distance^2)
  double x = 0.0, y = 0.0, z = 0.0, radius = 0.0;
};

/// One Gauss-Newton step with Huber weights; false when the points do not fit on the sphere at all.
bool improve_sphere(const std::vector<Eigen::Vector3d>& points, FittedSphere& sphere, double& step) {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (const Eigen::Vector3d& point : points) {
    const double dx = point.x() - sphere.x, dy = point.y() - sphere.y;
    const double under_root = sphere.radius * sphere.radius - dx * dx - dy * dy;
    if (under_root < 1e-4 * sphere.radius * sphere.radius) return false;
    const double root = std::sqrt(under_root);
    const double residual = sphere.z - root - point.z();
    const Eigen::Vector4d jacobian(-dx / root, -dy / root, 1.0, -sphere.radius / root);
    const double weight = std::min(1.0, kSphereHuberMm / std::max(std::abs(residual), 1e-12));
    information += weight * jacobian * jacobian.transpose();
    right -= weight * residual * jacobian;
  }
  const Eigen::Vector4d update = information.ldlt().solve(right);
  if (!update.allFinite()) return false;
  sphere.x += update[0];
  sphere.y += update[1];
  sphere.z += update[2];
  sphere.radius += update[3];
  step = update.norm();
  return true;
}

/// Radius of the sphere that fits the height inside the zone: robust least squares (Huber, Gauss-Newton) over
/// center and radius, from `start_radius_mm`. Pixels that markers cover are left out. Nothing when it has
/// fewer than 100 pixels or does not converge.
std::optional<double> fit_ball_radius_mm(const Surface& surface, const CalibrationPress& press,
                                         const BallZone& zone, double start_radius_mm) {
  std::vector<Eigen::Vector3d> points;
  double lowest_mm = 0.0;
  for (int v = 0; v < surface.height_mm.rows; ++v) {
    for (int u = 0; u < surface.height_mm.cols; ++u) {
      if (std::hypot(u - zone.u_px, v - zone.v_px) > zone.radius_px || !press.shows_gel(u, v)) continue;
      points.emplace_back(u * surface.pixel_pitch_mm, v * surface.pixel_pitch_mm, surface.height_mm(v, u));
      lowest_mm = std::min(lowest_mm, points.back().z());
    }
  }
  if (points.size() < kMinSpherePixels) return std::nullopt;
  FittedSphere sphere{zone.u_px * surface.pixel_pitch_mm, zone.v_px * surface.pixel_pitch_mm,
                      lowest_mm + start_radius_mm, start_radius_mm};
  for (int iteration = 0; iteration < kMaxSphereIterations; ++iteration) {
    double step = 0.0;
    if (!improve_sphere(points, sphere, step)) return std::nullopt;
    if (step < 1e-6) return sphere.radius;
  }
  return std::nullopt;
}

/// Sums of what was read, in cells of the gel.
class CellMap {
 public:
  void add(const std::vector<ZoneReading>& pixels, const cv::Size& size) {
    for (const ZoneReading& pixel : pixels)
      cells_[static_cast<std::size_t>(pixel.v * kCells.height / size.height * kCells.width +
                                      pixel.u * kCells.width / size.width)]
          .add(pixel.read, pixel.truth, pixel.sigma_rad);
  }
  /// `value` of every cell with enough pixels, else NaN.
  template <class Value>
  cv::Mat1f map(double least_pixels, const Value& value) const {
    cv::Mat1f result(kCells);
    std::transform(cells_.begin(), cells_.end(), result.begin(), [&](const SlopeSums& cell) {
      return cell.pixels < least_pixels ? std::numeric_limits<float>::quiet_NaN()
                                        : static_cast<float>(value(cell));
    });
    return result;
  }

 private:
  std::vector<SlopeSums> cells_{static_cast<std::size_t>(kCells.area())};
};

const char* place_name(std::size_t ninth) {
  constexpr std::array<const char*, 9> names = {"upper left",  "upper middle", "upper right",
                                                "middle left", "middle",       "middle right",
                                                "lower left",  "lower middle", "lower right"};
  return names[ninth];
}

std::string scale_words(double scale) {
  return fmt::format("slopes read {:.0f} % too {}", 100.0 * std::abs(scale - 1.0),
                     scale > 1.0 ? "steep" : "flat");
}

Verdict worse(Verdict a, Verdict b) { return std::max(a, b); }

Verdict judge_number(double value, double good_limit, double usable_limit) {
  if (std::abs(value) <= good_limit) return Verdict::good;
  return std::abs(value) <= usable_limit ? Verdict::usable : Verdict::recalibrate;
}

void judge(ModelCheck& check, const std::vector<double>& rim_slopes) {
  std::vector<std::pair<Verdict, std::string>> found;
  const auto note = [&](Verdict verdict, std::string reason) {
    if (verdict != Verdict::good) found.emplace_back(verdict, std::move(reason));
  };
  const double error = check.errors.all.mean_abs_error_deg();
  note(judge_number(error, kGoodLimits.error_deg, kUsableLimits.error_deg),
       fmt::format("slopes are wrong by {:.1f} degrees on average", error));
  const double scale = check.scales.all.scale();
  note(judge_number(scale - 1.0, kGoodLimits.scale, kUsableLimits.scale), scale_words(scale));
  for (const DiameterCheck& ball : check.diameters)
    note(judge_number(ball.radius_error(), kGoodLimits.radius, kUsableLimits.radius),
         fmt::format("balls of {:.2f} mm come out {:+.1f} % in radius", ball.diameter_mm,
                     100.0 * ball.radius_error()));
  for (std::size_t k = 0; k < 9; ++k) {
    const SlopeSums& ninth = check.scales.ninths[k];
    if (ninth.pixels < kMinNinthPixels || std::abs(ninth.scale() - 1.0) < kOddNinthScale) continue;
    note(Verdict::usable, fmt::format("at the {} of the gel {}", place_name(k), scale_words(ninth.scale())));
  }
  if (std::string missing = missing_depths(rim_slopes); !missing.empty())
    note(Verdict::usable, std::move(missing));
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  check.verdict = Verdict::good;
  for (auto& [verdict, reason] : found) {
    check.verdict = worse(check.verdict, verdict);
    check.reasons.push_back(std::move(reason));
  }
}

}  // namespace

const char* verdict_name(Verdict verdict) {
  return verdict == Verdict::good ? "good" : verdict == Verdict::usable ? "usable" : "recalibrate";
}

ModelCheck check_model(const GradientModel& model, const PressSet& set, const std::vector<BallZone>& zones,
                       double pixel_pitch_mm, const std::function<void(std::size_t)>& progress) {
  if (zones.empty()) throw Error("'" + set.folder.string() + "': no press can be used to check a model");
  SurfaceOptions options;
  options.pixel_pitch_mm = pixel_pitch_mm;
  // What a press does to the colors around it would be taken for a change of light (1 % of a real ball's
  // radius), and single pictures have no light to follow from one to the next.
  options.compensate_light = false;
  SurfaceEstimator estimator(model, set.background, options);
  ModelCheck check;
  CellMap error_cells, scale_cells;
  std::vector<double> rim_slopes;
  struct Size {
    std::vector<double> radii_mm;
    SlopeSums slopes;
    std::size_t presses = 0;
  };
  std::map<double, Size> sizes;
  for (const BallZone& zone : zones) {
    const CalibrationPress& press = set.presses[zone.press];
    rim_slopes.push_back(rim_slope(zone.radius_px, 0.5 * press.diameter_mm / pixel_pitch_mm));
    const std::vector<ZoneReading> labelled = read_zone(model, set, zone, pixel_pitch_mm, false);
    const SlopeStatistics errors = statistics_of(labelled, press.bgr.size());
    const std::vector<ZoneReading> recentered = read_zone(model, set, zone, pixel_pitch_mm, true);
    const SlopeStatistics scales = statistics_of(recentered, press.bgr.size());
    check.errors.add(errors);
    check.scales.add(scales);
    error_cells.add(labelled, press.bgr.size());
    scale_cells.add(recentered, press.bgr.size());
    const SurfacePtr surface = estimator.estimate(press.bgr);
    const auto radius_mm = fit_ball_radius_mm(*surface, press, zone, 0.5 * press.diameter_mm);
    check.presses.push_back({zone, errors.all.mean_abs_error_deg(), radius_mm});
    Size& size = sizes[press.diameter_mm];
    size.slopes.add(scales.all);
    ++size.presses;
    if (radius_mm) size.radii_mm.push_back(*radius_mm);
    if (progress) progress(check.presses.size());
  }
  for (const auto& [diameter_mm, size] : sizes)
    check.diameters.push_back({diameter_mm, size.presses, median(size.radii_mm), size.slopes.scale()});
  check.error_map_deg = error_cells.map(1.0, [](const SlopeSums& cell) { return cell.mean_abs_error_deg(); });
  check.scale_map = scale_cells.map(kMinCellPixels, [](const SlopeSums& cell) { return cell.scale(); });
  judge(check, rim_slopes);
  return check;
}

}  // namespace gelslam
