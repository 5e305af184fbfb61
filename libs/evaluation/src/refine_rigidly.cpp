// Point-to-plane ICP (Chen & Medioni 1992) of a reconstruction onto the true surface. Each iteration finds
// the closest triangle of every sample and makes a Gauss-Newton step with Huber weights, whose threshold
// follows the median residual. The step is made along the eigenvectors of the information matrix, except
// those that the surface does not determine. The pose with the smallest mean distance is returned.

#include <algorithm>
#include <cmath>
#include <utility>

#include "gelslam/core/median.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/evaluation/mesh_metrics.hpp"

namespace gelslam {
namespace {

constexpr int kMatchSamples = 15'000;
constexpr std::uint64_t kMatchSeed = 2;
constexpr int kMaxIterations = 60;
constexpr double kSmallestStepMm = 1e-5;
// Directions whose information is below this fraction of the largest one are not determined by the surface.
constexpr double kUnobservableShare = 1e-4;

/// Closest points and residuals of the samples at one pose.
struct Matches {
  std::vector<Eigen::Vector3d> points;
  std::vector<ClosestPoint> closest;
  double mean_distance = 0.0;
};

Matches match(const std::vector<Eigen::Vector3d>& samples, const Pose& pose, const TriangleScene& truth) {
  Matches matches;
  for (const Eigen::Vector3d& sample : samples) matches.points.push_back(pose * sample);
  matches.closest = truth.closest(matches.points);
  for (const ClosestPoint& closest : matches.closest)
    matches.mean_distance += closest.distance_mm / static_cast<double>(samples.size());
  return matches;
}

Eigen::Vector3d centroid(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

double spread(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& center) {
  double sum = 0.0;
  for (const Eigen::Vector3d& point : points) sum += (point - center).squaredNorm();
  return std::sqrt(sum / static_cast<double>(points.size()));
}

double huber_threshold(const std::vector<double>& residuals) {
  std::vector<double> magnitudes;
  for (const double residual : residuals) magnitudes.push_back(std::abs(residual));
  // 1.345 gives 95 % efficiency; 1.4826 converts a median to a standard deviation.
  return std::max(1e-6, 1.345 * 1.4826 * median(std::move(magnitudes)));
}

/// Returns one Gauss-Newton step about `center`: first the rotation times `radius`, so that all six entries
/// are lengths, then the translation.
Vector6d gauss_newton_step(const Matches& matches, const TriangleScene& truth, const Eigen::Vector3d& center,
                           double radius) {
  std::vector<Vector6d> jacobians;
  std::vector<double> residuals;
  for (std::size_t i = 0; i < matches.points.size(); ++i) {
    const Eigen::Vector3d normal = truth.triangle_normal(matches.closest[i].triangle);
    Vector6d jacobian;
    jacobian << (matches.points[i] - center).cross(normal) / radius, normal;
    jacobians.push_back(jacobian);
    residuals.push_back(normal.dot(matches.points[i] - matches.closest[i].point_mm));
  }
  const double threshold = huber_threshold(residuals);
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const double weight = std::min(1.0, threshold / std::max(1e-12, std::abs(residuals[i])));
    information += weight * jacobians[i] * jacobians[i].transpose();
    gradient += weight * residuals[i] * jacobians[i];
  }
  const SymmetricEigen eigen = symmetric_eigen(information);
  const double strongest = eigen.values.maxCoeff();
  Vector6d result = Vector6d::Zero();
  for (int k = 0; k < 6; ++k) {
    const double eigenvalue = eigen.values[k];
    if (eigenvalue <= kUnobservableShare * strongest) continue;
    const Vector6d direction = eigen.vectors.col(k);
    result -= direction.dot(gradient) / eigenvalue * direction;
  }
  return result;
}

Pose moved(const Pose& pose, const Vector6d& step, const Eigen::Vector3d& center, double radius) {
  const Pose turn(so3_exp(step.head<3>() / radius));
  return normalized(Eigen::Translation3d(center + step.tail<3>()) * turn * Eigen::Translation3d(-center) *
                    pose);
}

}  // namespace

Refinement refine_rigidly(const TriangleScene& estimate, const TriangleScene& truth) {
  const std::vector<Eigen::Vector3d> samples =
      sample_points(sample_surface(estimate.mesh(), kMatchSamples, kMatchSeed));
  const Eigen::Vector3d first_center = centroid(samples);
  const double radius = std::max(1e-6, spread(samples, first_center));
  Pose pose = Pose::Identity();
  Refinement best;
  Matches matches = match(samples, pose, truth);
  double best_distance = matches.mean_distance;
  for (int i = 0; i < kMaxIterations; ++i) {
    const Eigen::Vector3d center = pose * first_center;
    const Vector6d change = gauss_newton_step(matches, truth, center, radius);
    pose = moved(pose, change, center, radius);
    matches = match(samples, pose, truth);
    if (matches.mean_distance < best_distance) {
      best_distance = matches.mean_distance;
      best.truth_T_estimate = pose;
    }
    if (change.norm() < kSmallestStepMm) break;
  }
  best.shift_mm = (best.truth_T_estimate * first_center - first_center).norm();
  best.rotation_deg = rotation_angle_rad(best.truth_T_estimate) * kDegreesPerRadian;
  return best;
}

}  // namespace gelslam
