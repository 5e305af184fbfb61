#include "gelslam/surface/camera_model.hpp"

#include <algorithm>
#include <limits>

namespace gelslam {
namespace {

// The lens is modeled by one coefficient of radial distortion: a point at the distance r from the principal
// point, in half picture widths, appears at r (1 + k1 r²).

/// Returns the largest r, in half picture widths, up to which r (1 + k1 r²) grows with r.
double last_radius(double k1) {
  return k1 < 0 ? std::sqrt(-1 / (3 * k1)) : std::numeric_limits<double>::infinity();
}

/// Solves r (1 + k1 r²) = `radius` for r by Newton's method. It converges monotonically, because the function
/// is convex or concave.
double undistorted(double radius, double k1) {
  constexpr int kSteps = 20;
  const double last = last_radius(k1);
  double r = std::min(radius, last);
  for (int step = 0; step < kSteps; ++step) {
    const double slope = 1 + 3 * k1 * r * r;
    if (!(slope > 1e-9)) break;
    r = std::min(r - (r * (1 + k1 * r * r) - radius) / slope, last);
  }
  return r;
}

Eigen::Vector2d axis_scale(const SensorOptics& optics) {
  return {std::sqrt(optics.pixel_aspect), 1 / std::sqrt(optics.pixel_aspect)};
}

}  // namespace

std::optional<Eigen::Vector2d> CameraModel::raw_px(const Eigen::Vector2d& px) const {
  const double half_width = 0.5 * size.width;
  const Eigen::Vector2d r = axis_scale(optics).cwiseProduct(px - center_px()) / half_width;
  if (r.norm() > last_radius(optics.lens_k1)) return std::nullopt;
  return principal_px() + half_width * (1 + optics.lens_k1 * r.squaredNorm()) * r;
}

Eigen::Vector2d CameraModel::rectified_px(const Eigen::Vector2d& raw_px) const {
  const Eigen::Vector2d distorted = (raw_px - principal_px()) / (0.5 * size.width);
  const double radius = distorted.norm();
  const double scale = radius > 0 ? undistorted(radius, optics.lens_k1) / radius : 1.0;
  return center_px() + 0.5 * size.width * scale * distorted.cwiseQuotient(axis_scale(optics));
}

}  // namespace gelslam
