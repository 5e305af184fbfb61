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

constexpr double kRimMm = 0.4;               // at a contact's border the gel is draped
constexpr double kMaxRadiusFraction = 0.85;  // beyond, the sphere is steeper than any gel shows
constexpr int kMinPixels = 300;
constexpr int kIterations = 10;
// Of the variance of what is read: presses of real balls leave 0.5 to 0.99 through five models.
constexpr double kMinExplained = 0.5;
// Single presses differ by so much on four sensors: a model errs otherwise at each place.
constexpr double kPressSigma = 0.15;
// Own models of four sensors, which are right within 3 %, come out as 0.90 to 1.09: contacts drape, too.
constexpr double kMethodSigma = 0.06;

struct Reading {
  Vector2d place_mm, rest_slope, read;  // read: relative to the gel at rest
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

/// Nothing where the touch is not that of such a ball.
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
  constexpr double kChiSquared = 9.49;  // of four degrees of freedom, 5 %
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
  // Medians: a press at the picture's border, of which one flank is seen, may say anything.
  for (Eigen::Index k = 0; k < 4; ++k) {
    std::vector<double> values(found.size());
    std::ranges::transform(found, values.begin(), [k](const Matrix2d& matrix) { return matrix(k); });
    const double middle = median(values);
    for (double& value : values) value = std::abs(value - middle);
    // The spread of few is uncertain itself: the usual one counts like one press.
    const double spread = 1.4826 * median(values);
    result.read_over_true(k) = middle;
    const double of_median = 1.25 * std::hypot(spread, kPressSigma / std::sqrt(count)) / std::sqrt(count);
    result.sigma(k) = std::hypot(of_median, kMethodSigma);
  }
  return result;
}

}  // namespace gelslam
