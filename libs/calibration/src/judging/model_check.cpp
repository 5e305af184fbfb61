// Judges a gradient model on presses of balls of known diameter (not in the paper): errors and scale of the
// slopes over the gel, radii of the reconstructed balls, and how errors change with the position. The limits
// come from models of four sensors.

#include "gelslam/calibration/model_check.hpp"

#include <ceres/ceres.h>
#include <fmt/core.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "gelslam/calibration/press_coverage.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/surface/surface_estimator.hpp"

namespace gelslam {
namespace {

// Limits from models of four sensors: a good, fresh calibration stays within the first limits, a model of the
// published recipe within the second.
struct Limits {
  double error_deg, scale, radius;
};
constexpr Limits kGoodLimits = {3.0, 0.03, 0.03}, kUsableLimits = {5.0, 0.10, 0.08};
constexpr double kOddNinthScale = 0.15;  // Deviation of the scale in one ninth from which it is reported.
constexpr double kMinNinthPixels = 1500;

// Change of the slope error per mm. Half of a sensor is 10 mm long.
constexpr double kMaxErrorPerMm = 0.001;

constexpr int kMinSpherePixels = 100;
constexpr double kSphereHuberMm = 0.01;

/// Residual: height of the lower half of a sphere (center x, y, z and radius) above a point.
struct HeightAbovePoint {
  Eigen::Vector3d point;
  template <class T>
  bool operator()(const T* sphere, T* height) const {
    using std::sqrt;
    const T dx = point.x() - sphere[0], dy = point.y() - sphere[1], squared = sphere[3] * sphere[3];
    const T under_root = squared - dx * dx - dy * dy;
    if (under_root < 1e-4 * squared) return false;
    *height = sphere[2] - sqrt(under_root) - point.z();
    return true;
  }
};

/// Returns the radius of the sphere fitted to the heights inside the zone: robust least squares over center
/// and radius, starting from `start_radius_mm`. Pixels that markers cover are left out. Returns nothing if
/// there are fewer than 100 pixels, or if the fit does not converge.
std::optional<double> fit_ball_radius_mm(const Surface& surface, const CalibrationPress& press,
                                         const BallZone& zone, double start_radius_mm) {
  std::vector<Eigen::Vector3d> points;
  double lowest_mm = 0.0;
  const CameraModel camera = surface.camera();
  Eigen::Vector2d middle_mm = Eigen::Vector2d::Zero();
  for_each_pixel(SeenBall(camera, zone, press.diameter_mm), press,
                 [&](int, int, const Eigen::Vector2d& rest_mm) {
                   const auto pixel = camera.pixel_of(camera.to_px(rest_mm));
                   if (!pixel) return;
                   points.push_back(surface.point_mm(*pixel));
                   middle_mm += points.back().head<2>();
                   lowest_mm = std::min(lowest_mm, points.back().z());
                 });
  if (points.size() < kMinSpherePixels) return std::nullopt;
  middle_mm /= static_cast<double>(points.size());
  std::array<double, 4> sphere = {middle_mm.x(), middle_mm.y(), lowest_mm + start_radius_mm, start_radius_mm};
  ceres::Problem problem;
  for (const Eigen::Vector3d& point : points)
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<HeightAbovePoint, 1, 4>(new HeightAbovePoint{point}),
        new ceres::HuberLoss(kSphereHuberMm), sphere.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;  // Cholesky fails for flat heights and prints a message.
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (summary.termination_type != ceres::CONVERGENCE) return std::nullopt;
  return sphere[3];
}

std::string scale_words(double scale) {
  return fmt::format("slopes read {:.0f} % too {}", 100.0 * std::abs(scale - 1.0),
                     scale > 1.0 ? "steep" : "flat");
}

Verdict judge_number(double value, double good_limit, double usable_limit) {
  if (std::abs(value) <= good_limit) return Verdict::good;
  return std::abs(value) <= usable_limit ? Verdict::usable : Verdict::recalibrate;
}

/// Regression of the presses' mean slope errors on their position along an axis.
struct ErrorOverPlace {
  double per_mm, sigma_per_mm;
};
ErrorOverPlace error_over_place(const std::vector<PressCheck>& presses, const CameraModel& camera,
                                std::size_t axis) {
  const auto count = static_cast<Eigen::Index>(presses.size());
  Eigen::ArrayXd place_mm(count), error(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const PressCheck& press = presses[static_cast<std::size_t>(k)];
    place_mm[k] =
        camera.to_mm(camera.rectified_px({press.zone.u_px, press.zone.v_px}))(static_cast<int>(axis));
    error[k] = press.mean_error[axis];
  }
  place_mm -= place_mm.mean();
  error -= error.mean();
  const double spread = 1e-12 + place_mm.square().sum(), per_mm = (place_mm * error).sum() / spread;
  const double left = (error - per_mm * place_mm).square().sum();
  return {per_mm, std::sqrt(left / std::max(1.0, static_cast<double>(count) - 2.0) / spread)};
}

void judge(ModelCheck& check, const std::vector<double>& rim_slopes, const CameraModel& camera) {
  std::vector<std::pair<Verdict, std::string>> found;
  const auto note = [&](Verdict verdict, std::string reason) {
    if (verdict != Verdict::good) found.emplace_back(verdict, std::move(reason));
  };
  // Wrong slopes distort the surface.
  const double error = check.slopes.all.mean_abs_error_deg();
  note(judge_number(error, kGoodLimits.error_deg, kUsableLimits.error_deg),
       fmt::format("slopes are wrong by {:.1f} degrees on average", error));
  // The length of a rolled path is too long by the same factor.
  const double scale = check.slopes.all.scale();
  note(judge_number(scale - 1.0, kGoodLimits.scale, kUsableLimits.scale), scale_words(scale));
  // Errors of the heights, or a wrong diameter of the ball.
  for (const DiameterCheck& ball : check.diameters)
    note(judge_number(ball.radius_error(), kGoodLimits.radius, kUsableLimits.radius),
         fmt::format("balls of {:.2f} mm come out {:+.1f} % in radius", ball.diameter_mm,
                     100.0 * ball.radius_error()));
  // Detects a place without presses, which the mean over the gel hides.
  for (std::size_t k = 0; k < 9; ++k) {
    const SlopeSums& ninth = check.slopes.ninths[k];
    if (ninth.pixels < kMinNinthPixels || std::abs(ninth.scale() - 1.0) < kOddNinthScale) continue;
    note(Verdict::usable,
         fmt::format("at the {} of the gel {}", press_zone_name(k), scale_words(ninth.scale())));
  }
  // Detects a wrong dome, or circles that are displaced from their balls because the camera is near.
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const ErrorOverPlace error_over = error_over_place(check.presses, camera, axis);
    if (std::abs(error_over.per_mm) < kMaxErrorPerMm + 2.0 * error_over.sigma_per_mm) continue;
    note(Verdict::usable,
         fmt::format("slopes along {} err by {:+.4f} +- {:.4f} per mm of place: the sensor's "
                     "optics are not those of these presses",
                     axis == 0 ? "x" : "y", error_over.per_mm, error_over.sigma_per_mm));
  }
  if (std::string missing = missing_depths(rim_slopes); !missing.empty())
    note(Verdict::usable, std::move(missing));
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  check.verdict = Verdict::good;
  for (auto& [verdict, reason] : found) {
    check.verdict = std::max(check.verdict, verdict);
    check.reasons.push_back(std::move(reason));
  }
}

}  // namespace

const char* verdict_name(Verdict verdict) {
  return verdict == Verdict::good ? "good" : verdict == Verdict::usable ? "usable" : "recalibrate";
}

ModelCheck check_model(std::span<const GradientModel> models, const PressSet& set,
                       const std::vector<BallZone>& zones, double pixel_pitch_mm,
                       const std::function<void(std::size_t)>& progress) {
  if (zones.empty()) throw Error("'" + set.folder.string() + "': no press can be used to check a model");
  SurfaceOptions options;
  options.pixel_pitch_mm = pixel_pitch_mm;
  options.optics = set.optics.value_or(SensorOptics{});
  // read_press_set() has already converted the images to the background's light.
  options.compensate_light = false;
  std::vector<SurfaceEstimator> estimators;
  for (const GradientModel& model : models) estimators.emplace_back(model, set.background, options);
  ModelCheck check;
  std::vector<double> rim_slopes;
  struct Size {
    std::vector<double> radii_mm;
    std::size_t presses = 0;
  };
  std::map<double, Size> sizes;
  for (std::size_t k = 0; k < zones.size(); ++k) {
    const BallZone& zone = zones[k];
    const CalibrationPress& press = set.presses[zone.press];
    rim_slopes.push_back(rim_slope(zone.radius_px, press.ball_px(pixel_pitch_mm)));
    SlopeSums slopes;
    std::array<double, 2> error{};
    for (const ZoneReading& pixel : read_zone(models[k % models.size()], set, zone, pixel_pitch_mm)) {
      slopes.add(pixel);
      check.slopes.add(pixel, press.bgr.size());
      for (std::size_t axis = 0; axis < 2; ++axis) error[axis] += pixel.read[axis] - pixel.labeled[axis];
    }
    for (double& sum : error) sum /= std::max(1.0, slopes.pixels);
    const SurfacePtr surface = estimators[k % models.size()].estimate(press.bgr);
    const auto radius_mm = fit_ball_radius_mm(*surface, press, zone, 0.5 * press.diameter_mm);
    check.presses.push_back({zone, slopes.mean_abs_error_deg(), error, radius_mm});
    Size& size = sizes[press.diameter_mm];
    ++size.presses;
    if (radius_mm) size.radii_mm.push_back(*radius_mm);
    if (progress) progress(check.presses.size());
  }
  for (const auto& [diameter_mm, size] : sizes)
    check.diameters.push_back({diameter_mm, size.presses, median(size.radii_mm)});
  judge(check, rim_slopes, set.camera(pixel_pitch_mm));
  return check;
}

}  // namespace gelslam
