#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "gelslam/evaluation/mesh_metrics.hpp"
#include "mesh_renderer.hpp"

namespace gelslam::evaluation::detail {
namespace {

constexpr int kSamples = 4000;
constexpr std::uint64_t kSeed = 5;
constexpr int kDirections = 500;
constexpr double kMargin = 0.07;
constexpr double kContext = 1.35;  // of another, larger mesh: at most this much of the main mesh's extent

struct OrientedPoints {
  std::vector<Eigen::Vector3d> points, normals;
};

OrientedPoints sample_oriented(const Mesh& mesh) {
  OrientedPoints result;
  for (const SurfaceSample& sample : sample_surface(mesh, kSamples, kSeed)) {
    const Eigen::Vector3i& t = mesh.triangles[static_cast<std::size_t>(sample.triangle)];
    const auto corner = [&](int k) -> Eigen::Vector3d {
      return mesh.vertices_mm[static_cast<std::size_t>(t[k])].cast<double>();
    };
    result.points.push_back(sample.point_mm);
    result.normals.push_back((corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized());
  }
  return result;
}

/// The k-th of `kDirections` nearly evenly spread directions (Fibonacci sphere).
Eigen::Vector3d direction(int k) {
  const double z = 1.0 - 2.0 * (k + 0.5) / kDirections;
  const double angle = k * std::numbers::pi * (3.0 - std::sqrt(5.0));
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

Eigen::Vector3d best_direction(const std::vector<Eigen::Vector3d>& normals) {
  Eigen::Vector3d best = Eigen::Vector3d::UnitZ();
  double best_score = -1.0;
  for (int k = 0; k < kDirections; ++k) {
    double score = 0.0;
    for (const Eigen::Vector3d& normal : normals) score += std::max(0.0, normal.dot(direction(k)));
    if (score > best_score) {
      best_score = score;
      best = direction(k);
    }
  }
  return best;
}

/// The longest direction of the points as seen from `toward_viewer`.
Eigen::Vector3d long_axis(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& toward_viewer) {
  const Eigen::Matrix3d flat = Eigen::Matrix3d::Identity() - toward_viewer * toward_viewer.transpose();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) mean += point / static_cast<double>(points.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d offset = flat * (point - mean);
    covariance += offset * offset.transpose();
  }
  Eigen::Vector3d axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors().col(2);
  Eigen::Index strongest = 0;
  axis.cwiseAbs().maxCoeff(&strongest);
  return axis[strongest] < 0.0 ? Eigen::Vector3d(-axis) : axis;  // an eigenvector's sign is arbitrary
}

struct Bounds {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e30), high = Eigen::Vector3d::Constant(-1e30);
};

Bounds bounds_in(const View& view, const Mesh& mesh) {
  Bounds bounds;
  for (const Eigen::Vector3i& triangle : mesh.triangles) {
    for (const int vertex : triangle) {
      const Eigen::Vector3d p = mesh.vertices_mm[static_cast<std::size_t>(vertex)].cast<double>();
      const Eigen::Vector3d q(view.right.dot(p), view.up.dot(p), view.toward_viewer.dot(p));
      bounds.low = bounds.low.cwiseMin(q);
      bounds.high = bounds.high.cwiseMax(q);
    }
  }
  return bounds;
}

}  // namespace

View facing_view(const Mesh& mesh) {
  const OrientedPoints surface = sample_oriented(mesh);
  View view;
  view.toward_viewer = best_direction(surface.normals);
  view.up = long_axis(surface.points, view.toward_viewer);
  view.right = view.up.cross(view.toward_viewer).normalized();
  view.up = view.toward_viewer.cross(view.right);
  return view;
}

View turned(const View& view, double angle_deg) {
  const Eigen::AngleAxisd turn(angle_deg * std::numbers::pi / 180.0, view.up);
  return {turn * view.right, view.up, turn * view.toward_viewer};
}

Framing frame(const View& view, const Mesh& main, const Mesh& other, int width_px) {
  const Bounds own = bounds_in(view, main);
  const Bounds rest = bounds_in(view, other);
  const Eigen::Vector3d middle = 0.5 * (own.low + own.high);
  const Eigen::Vector3d half = 0.5 * kContext * (own.high - own.low);
  const Eigen::Vector3d low = own.low.cwiseMin(rest.low.cwiseMax(middle - half));
  const Eigen::Vector3d high = own.high.cwiseMax(rest.high.cwiseMin(middle + half));
  const Eigen::Vector3d center = 0.5 * (low + high);
  const Eigen::Vector3d extent = (1.0 + 2.0 * kMargin) * (high - low).cwiseMax(1e-6);
  Framing framing;
  framing.width_px = width_px;
  framing.height_px = static_cast<int>(width_px * std::clamp(extent.y() / extent.x(), 0.75, 1.5));
  framing.mm_per_px = std::max(extent.x() / framing.width_px, extent.y() / framing.height_px);
  framing.center_mm = center.x() * view.right + center.y() * view.up + center.z() * view.toward_viewer;
  framing.depth_mm = 1.0 + std::max((own.high - center).cwiseAbs().z(), (rest.high - center).cwiseAbs().z()) +
                     std::max((own.low - center).cwiseAbs().z(), (rest.low - center).cwiseAbs().z());
  return framing;
}

std::vector<Eigen::Vector3f> vertex_normals(const Mesh& mesh) {
  if (mesh.normals.size() == mesh.vertices_mm.size()) return mesh.normals;
  std::vector<Eigen::Vector3f> normals(mesh.vertices_mm.size(), Eigen::Vector3f::Zero());
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto corner = [&](int k) { return mesh.vertices_mm[static_cast<std::size_t>(t[k])]; };
    const Eigen::Vector3f twice_area = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    for (const int vertex : t) normals[static_cast<std::size_t>(vertex)] += twice_area;
  }
  for (Eigen::Vector3f& normal : normals) normal.normalize();
  return normals;
}

}  // namespace gelslam::evaluation::detail
