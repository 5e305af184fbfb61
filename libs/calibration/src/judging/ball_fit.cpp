#include "gelslam/calibration/ball_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

namespace gelslam {
namespace {

constexpr int kMinPixels = 100;
constexpr double kHuberMm = 0.01;
constexpr int kMaxSphereIterations = 50;

struct FittedSphere {  // lower half: z = center_z - sqrt(radius^2 - distance^2)
  double x = 0.0, y = 0.0, z = 0.0, radius = 0.0;
};

// One Gauss-Newton step with Huber weights; false when the points do not fit on the sphere at all.
bool improve(const std::vector<Eigen::Vector3d>& points, FittedSphere& sphere, double& step) {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (const Eigen::Vector3d& point : points) {
    const double dx = point.x() - sphere.x, dy = point.y() - sphere.y;
    const double under_root = sphere.radius * sphere.radius - dx * dx - dy * dy;
    if (under_root < 1e-4 * sphere.radius * sphere.radius) return false;
    const double root = std::sqrt(under_root);
    const double residual = sphere.z - root - point.z();
    const Eigen::Vector4d jacobian(-dx / root, -dy / root, 1.0, -sphere.radius / root);
    const double weight = std::min(1.0, kHuberMm / std::max(std::abs(residual), 1e-12));
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

}  // namespace

std::optional<double> fit_ball_radius_mm(const Surface& surface, const BallZone& zone,
                                         double start_radius_mm) {
  std::vector<Eigen::Vector3d> points;
  double lowest_mm = 0.0;
  for (int v = 0; v < surface.height_mm.rows; ++v) {
    for (int u = 0; u < surface.height_mm.cols; ++u) {
      if (std::hypot(u - zone.u_px, v - zone.v_px) > zone.radius_px) continue;
      points.emplace_back(u * surface.pixel_pitch_mm, v * surface.pixel_pitch_mm, surface.height_mm(v, u));
      lowest_mm = std::min(lowest_mm, points.back().z());
    }
  }
  if (points.size() < kMinPixels) return std::nullopt;
  FittedSphere sphere{zone.u_px * surface.pixel_pitch_mm, zone.v_px * surface.pixel_pitch_mm,
                      lowest_mm + start_radius_mm, start_radius_mm};
  for (int iteration = 0; iteration < kMaxSphereIterations; ++iteration) {
    double step = 0.0;
    if (!improve(points, sphere, step)) return std::nullopt;
    if (step < 1e-6) return sphere.radius;
  }
  return std::nullopt;
}

}  // namespace gelslam
