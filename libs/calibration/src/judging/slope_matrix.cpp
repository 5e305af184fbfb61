// Estimates how a gradient model distorts slopes, from touches of a ball of known diameter (not in the
// paper).
//
// Slopes in this file are gradients (tangents), relative to those of the gel at rest. At a point p of a
// sphere with center c and radius R, the gradient is s = (p - c) / sqrt(R² - |p - c|²). Each touch gives a
// matrix A by two alternating steps: first, each pixel's corrected slope, A⁻¹ times the read one, implies a
// center of the sphere, and c is the mean of these; second, A is the linear regression of the read slopes on
// the true ones. The result is the median over all touches, entry by entry. Its standard deviation comes from
// their median absolute deviation, combined with kPressSigma as a prior and kMethodSigma as a lower limit. A
// touch counts only if the fit explains at least half of the variance of the read slopes.

#include "gelslam/calibration/slope_matrix.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/surface/slopes.hpp"

namespace gelslam {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

// Near the border of the contact the gel is draped and does not touch the ball, so this margin is left out.
constexpr double kRimMm = 0.4;
// Fraction of the ball's radius. Beyond it the sphere is steeper than the gel can follow.
constexpr double kMaxRadiusFraction = 0.85;
constexpr int kMinPixels = 300;
constexpr int kIterations = 10;
// Fraction of the read slopes' variance. On presses of real balls, five models reach 0.5 to 0.99.
constexpr double kMinExplained = 0.5;
// The standard deviation of an entry between presses, measured on four sensors. It is not 0, because the
// errors of a model differ from place to place.
constexpr double kPressSigma = 0.15;
// The models of four sensors, whose errors are below 3 %, gave entries of 0.90 to 1.09 instead of 1, because
// the draped gel at the rim changes the result, too.
constexpr double kMethodSigma = 0.06;

struct Reading {
  Vector2d place_mm, rest_slope, read;  // `read` is the slope relative to the gel at rest.
};

std::vector<Reading> readings_of(const Surface& surface) {
  const int rim_px = static_cast<int>(std::lround(kRimMm / surface.pixel_pitch_mm));
  cv::Mat1b inner;
  cv::erode(surface.contact, inner,
            cv::getStructuringElement(cv::MORPH_ELLIPSE, cv::Size(2 * rim_px + 1, 2 * rim_px + 1)),
            cv::Point(-1, -1), 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  std::vector<Reading> readings;
  const CameraModel camera = surface.camera();
  for (int v = 0; v < inner.rows; ++v)
    for (int u = 0; u < inner.cols; ++u) {
      if (inner(v, u) == 0 || !is_read(surface, {u, v})) continue;
      const cv::Vec3f& normal = surface.normals(v, u);
      const Vector2d place_mm = surface.point_mm({u, v}).head<2>(), rest = camera.rest_slope(place_mm);
      readings.push_back({place_mm, rest, Vector2d(-normal[0], -normal[1]) / normal[2] - rest});
    }
  return readings;
}

/// Returns the matrix A of one touch, or nothing if the touch does not look like such a ball.
std::optional<Matrix2d> read_over_true(const std::vector<Reading>& readings, double radius_mm) {
  if (readings.size() < kMinPixels) return std::nullopt;
  const auto count = static_cast<double>(readings.size());
  Vector2d mean_read = Vector2d::Zero();
  for (const Reading& reading : readings) mean_read += reading.read / count;
  Matrix2d scale = Matrix2d::Identity();
  double explained = 0;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Matrix2d correction = scale.inverse();
    Vector2d center_mm = Vector2d::Zero();
    for (const Reading& reading : readings) {
      const Vector2d slope = correction * reading.read + reading.rest_slope;
      center_mm += (reading.place_mm - radius_mm * slope / std::sqrt(1 + slope.squaredNorm())) / count;
    }
    Matrix2d read_true = Matrix2d::Zero(), true_true = Matrix2d::Zero();
    double spread = 0, left = 0;
    for (const Reading& reading : readings) {
      const Vector2d from_center = reading.place_mm - center_mm;
      const double depth2 = radius_mm * radius_mm - from_center.squaredNorm();
      if (depth2 < (1 - kMaxRadiusFraction * kMaxRadiusFraction) * radius_mm * radius_mm) continue;
      const Vector2d slope = from_center / std::sqrt(depth2) - reading.rest_slope;
      read_true += reading.read * slope.transpose();
      true_true += slope * slope.transpose();
      spread += (reading.read - mean_read).squaredNorm();
      left += (reading.read - scale * slope).squaredNorm();
    }
    scale = read_true * true_true.inverse();
    explained = 1 - left / spread;
    if (!scale.allFinite() || !(scale.determinant() > 0.01)) return std::nullopt;
  }
  return explained > kMinExplained ? std::optional(scale) : std::nullopt;
}

}  // namespace

bool SlopeMatrix::needs_correction() const {
  constexpr double kChiSquared = 9.49;  // 95 % quantile with four degrees of freedom.
  return (read_over_true - Matrix2d::Identity()).cwiseQuotient(sigma).squaredNorm() > kChiSquared;
}

SlopeMatrix slope_matrix_from_ball(const std::vector<SurfacePtr>& touches, double diameter_mm) {
  std::vector<Matrix2d> found;
  for (const SurfacePtr& touch : touches)
    if (const auto matrix = read_over_true(readings_of(*touch), 0.5 * diameter_mm)) found.push_back(*matrix);
  if (found.empty()) throw Error("nothing that touched looks like a ball of that diameter");
  SlopeMatrix result;
  result.touches = found.size();
  const auto count = static_cast<double>(found.size());
  // Medians are used because a press at the image border shows only one flank, and its matrix may be far off.
  for (Eigen::Index k = 0; k < 4; ++k) {
    std::vector<double> values(found.size());
    std::ranges::transform(found, values.begin(), [k](const Matrix2d& matrix) { return matrix(k); });
    const double middle = median(values);
    for (double& value : values) value = std::abs(value - middle);
    // The spread of few presses is itself uncertain, so the usual spread counts like one additional press.
    // 1.4826 times the median absolute deviation is the standard deviation of a normal distribution, and the
    // standard deviation of a median is 1.25 times that of a mean.
    const double spread = 1.4826 * median(values);
    result.read_over_true(k) = middle;
    const double of_median = 1.25 * std::hypot(spread, kPressSigma / std::sqrt(count)) / std::sqrt(count);
    result.sigma(k) = std::hypot(of_median, kMethodSigma);
  }
  return result;
}

}  // namespace gelslam
