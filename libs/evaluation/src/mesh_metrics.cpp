// Distances between a reconstructed and a true surface, by points sampled in proportion to area and their
// nearest triangles. accuracy: from the reconstruction to the truth; completeness: from the truth to the
// reconstruction.

#include "gelslam/evaluation/mesh_metrics.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "gelslam/core/error.hpp"
#include "gelslam/core/index.hpp"
#include "gelslam/core/median.hpp"

namespace gelslam {
namespace {

constexpr int kAccuracySamples = 200'000;
constexpr std::uint64_t kAccuracySeed = 1;
constexpr double kLevelsMm[] = {0.05, 0.1, 0.25};

/// Uniform in [0, 1) and the same on every platform, unlike std::uniform_real_distribution.
double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1.0p-53; }

std::vector<double> cumulated_areas(const Mesh& mesh) {
  std::vector<double> cumulated;
  double total = 0.0;
  for (const Eigen::Vector3i& triangle : mesh.triangles)
    cumulated.push_back(total += 0.5 * area_normal(mesh, triangle).norm());
  return cumulated;
}

Eigen::Vector3d point_on(const Mesh& mesh, std::size_t triangle, double u, double v) {
  const double root = std::sqrt(u);  // The root makes the points uniform over the area (Osada et al. 2002).
  const auto [a, b, c] = corners_mm(mesh, mesh.triangles[triangle]);
  return (1.0 - root) * a + root * (1.0 - v) * b + root * v * c;
}

std::vector<double> distances_of(const std::vector<ClosestPoint>& closest) {
  std::vector<double> distances;
  for (const ClosestPoint& point : closest) distances.push_back(point.distance_mm);
  return distances;
}

DistanceSummary summarize(std::vector<double> distances) {
  DistanceSummary summary;
  if (distances.empty()) return summary;
  std::sort(distances.begin(), distances.end());  // The mean is summed in ascending order, too.
  const auto ranked = [&](double share) {
    return distances[static_cast<std::size_t>(share * static_cast<double>(distances.size() - 1) + 0.5)];
  };
  for (const double distance : distances) summary.mean_mm += distance;
  summary.mean_mm /= static_cast<double>(distances.size());
  summary.median_mm = ranked(0.5);
  summary.p90_mm = ranked(0.9);
  summary.p95_mm = ranked(0.95);
  return summary;
}

std::vector<double> sampled_distances(const Mesh& surface, const TriangleScene& target) {
  return distances_of(
      target.closest(sample_points(sample_surface(surface, kAccuracySamples, kAccuracySeed))));
}

/// Returns the median angle between the normals of a surface, shifted along itself, and those of the target
/// nearby.
double turn_deg(const TriangleScene& surface, const TriangleScene& target, double aside_mm) {
  constexpr int kSamples = 20'000;
  const std::vector<SurfaceSample> samples = sample_surface(surface.mesh(), kSamples, kAccuracySeed);
  std::vector<Eigen::Vector3d> points, normals;
  for (const SurfaceSample& sample : samples) {
    normals.push_back(surface.triangle_normal(sample.triangle));
    points.push_back(sample.point_mm + aside_mm * normals.back().unitOrthogonal());
  }
  const std::vector<ClosestPoint> closest = target.closest(points);
  std::vector<double> cosines;
  for (std::size_t i = 0; i < points.size(); ++i)
    cosines.push_back(std::abs(normals[i].dot(target.triangle_normal(closest[i].triangle))));
  return std::acos(std::min(1.0, median(std::move(cosines)))) * kDegreesPerRadian;
}

double share_within(const std::vector<double>& distances, double limit_mm) {
  const auto near =
      std::count_if(distances.begin(), distances.end(), [&](double d) { return d <= limit_mm; });
  return distances.empty() ? 0.0 : static_cast<double>(near) / static_cast<double>(distances.size());
}

}  // namespace

std::vector<SurfaceSample> sample_surface(const Mesh& mesh, int count, std::uint64_t seed) {
  const std::vector<double> cumulated = cumulated_areas(mesh);
  if (cumulated.empty() || !(cumulated.back() > 0.0)) throw Error("the mesh has no area: nothing to measure");
  std::mt19937_64 random(seed);
  std::vector<SurfaceSample> samples;
  std::size_t triangle = 0;
  for (int i = 0; i < count; ++i) {
    const double area = (i + uniform(random)) / count * cumulated.back();
    while (triangle + 1 < cumulated.size() && cumulated[triangle] <= area) ++triangle;
    const double u = uniform(random);
    samples.push_back({point_on(mesh, triangle, u, uniform(random)), static_cast<int>(triangle)});
  }
  return samples;
}

std::vector<Eigen::Vector3d> sample_points(const std::vector<SurfaceSample>& samples) {
  std::vector<Eigen::Vector3d> points;
  for (const SurfaceSample& sample : samples) points.push_back(sample.point_mm);
  return points;
}

Mesh transformed(const Mesh& mesh, const Pose& target_T_mesh) {
  Mesh result = mesh;
  for (Eigen::Vector3f& vertex : result.vertices_mm)
    vertex = (target_T_mesh * vertex.cast<double>()).cast<float>();
  for (Eigen::Vector3f& normal : result.normals)
    normal = (target_T_mesh.linear() * normal.cast<double>()).cast<float>();
  return result;
}

double area_around(const std::vector<Eigen::Vector3d>& points_mm, const TriangleScene& surface) {
  const Mesh& mesh = surface.mesh();
  std::vector<bool> is_near(mesh.vertices_mm.size(), false);
  for (const ClosestPoint& closest : surface.closest(points_mm)) {
    const Eigen::Vector3i& corners = mesh.triangles[static_cast<std::size_t>(closest.triangle)];
    const auto nearest = std::ranges::min(corners, {}, [&](int corner) {
      return (mesh.vertices_mm[index(corner)].cast<double>() - closest.point_mm).squaredNorm();
    });
    is_near[index(nearest)] = true;
  }
  double area = 0;
  for (const Eigen::Vector3i& corners : mesh.triangles)
    // Each corner has a third of its triangle's area.
    for (const int corner : corners)
      if (is_near[index(corner)]) area += area_normal(mesh, corners).norm() / 6;
  return area;
}

DistanceSummary distances_from(const Mesh& surface, const TriangleScene& target) {
  return summarize(sampled_distances(surface, target));
}

MeshMetrics evaluate_mesh(const TriangleScene& estimate, const TriangleScene& truth,
                          const std::vector<Eigen::Vector3d>& truth_points_mm) {
  const std::vector<double> to_truth = sampled_distances(estimate.mesh(), truth);
  const std::vector<double> to_estimate = distances_of(estimate.closest(truth_points_mm));
  MeshMetrics metrics;
  metrics.accuracy = summarize(to_truth);
  metrics.completeness = summarize(to_estimate);
  metrics.normals_deg = turn_deg(estimate, truth, 0);
  metrics.normals_aside_deg = turn_deg(estimate, truth, 1);
  for (const double level : kLevelsMm) {
    const double precision = share_within(to_truth, level);
    const double completeness = share_within(to_estimate, level);
    const double sum = precision + completeness;
    metrics.within.push_back(
        {level, precision, completeness, sum > 0.0 ? 2.0 * precision * completeness / sum : 0.0});
  }
  return metrics;
}

}  // namespace gelslam
