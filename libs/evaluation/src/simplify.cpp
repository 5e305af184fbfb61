#include "gelslam/evaluation/simplify.hpp"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "gelslam/core/parallel.hpp"
#include "gelslam/mesh/mesh.hpp"

namespace gelslam {
namespace {

constexpr int kBounds = 10;           // on the quadric error: the error allowed, and 0.7 times the last
constexpr int kRounds = 6;            // of putting back what is too far off, for one bound
constexpr double kMaxPutBack = 0.05;  // share of triangles; with more a smaller bound is better
constexpr double kCover = 0.6;        // of its longest edge: a ball around a triangle's middle that covers it
constexpr double kMaxSteps = 1000;    // of a grid on a triangle, along its longest edge

Eigen::Vector3d corner_of(const Mesh& mesh, std::size_t triangle, int k) {
  return mesh.vertices_mm[static_cast<std::size_t>(mesh.triangles[triangle][k])].cast<double>();
}

double longest_edge_mm(const Mesh& mesh, std::size_t triangle) {
  double longest_mm = 0;
  for (int k = 0; k < 3; ++k)
    longest_mm =
        std::max(longest_mm, (corner_of(mesh, triangle, k) - corner_of(mesh, triangle, (k + 1) % 3)).norm());
  return longest_mm;
}

/// A triangular grid over a triangle, whose neighbors are at most `spacing_mm` apart.
void add_grid(const Mesh& mesh, std::size_t triangle, double spacing_mm,
              std::vector<Eigen::Vector3d>& points) {
  const double edge_mm = longest_edge_mm(mesh, triangle);
  const int n =
      edge_mm > spacing_mm ? static_cast<int>(std::min(kMaxSteps, std::ceil(edge_mm / spacing_mm))) : 1;
  const Eigen::Vector3d a = corner_of(mesh, triangle, 0), ab = corner_of(mesh, triangle, 1) - a,
                        ac = corner_of(mesh, triangle, 2) - a;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; i + j <= n; ++j) points.push_back(a + (i * ab + j * ac) / n);
}

struct Deviation {
  double largest_mm = 0;
  std::set<std::size_t> triangles;  ///< of the simple mesh, where it is more than what is allowed
};

Deviation measure(const TriangleScene& full, const TriangleScene& simple, double spacing_mm,
                  double allowed_mm) {
  Deviation deviation;
  const auto add = [&](double distance_mm, std::size_t triangle) {
    deviation.largest_mm = std::max(deviation.largest_mm, distance_mm);
    if (distance_mm > allowed_mm) deviation.triangles.insert(triangle);
  };
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3f& vertex : full.mesh().vertices_mm) points.push_back(vertex.cast<double>());
  for (const ClosestPoint& c : simple.closest(points))
    add(c.distance_mm, static_cast<std::size_t>(c.triangle));
  constexpr std::size_t kAtOnce = 10'000;  // triangles, so that their points fit in memory
  const std::size_t count = simple.mesh().triangles.size();
  for (std::size_t begin = 0; begin < count; begin += kAtOnce) {
    points.clear();
    std::vector<std::size_t> triangle_of_point;
    for (std::size_t t = begin; t < std::min(begin + kAtOnce, count); ++t) {
      add_grid(simple.mesh(), t, spacing_mm, points);
      triangle_of_point.resize(points.size(), t);
    }
    const std::vector<ClosestPoint> closest = full.closest(points);
    for (std::size_t i = 0; i < points.size(); ++i) add(closest[i].distance_mm, triangle_of_point[i]);
  }
  return deviation;
}

/// Edge collapse by quadric error (Garland & Heckbert 1997) up to `error_mm`. Triangles with a vertex that is
/// to be kept, and borders, stay as they are.
Mesh decimate(const Mesh& full, double error_mm, const std::vector<char>& keep_vertex) {
  std::vector<Eigen::Vector3i> triangles;
  std::vector<unsigned> corners;
  for (const Eigen::Vector3i& t : full.triangles) {
    const auto is_kept = [&](int corner) { return keep_vertex[static_cast<std::size_t>(corner)] != 0; };
    if (std::any_of(t.begin(), t.end(), is_kept)) {
      triangles.push_back(t);
    } else {
      for (const int corner : t) corners.push_back(static_cast<unsigned>(corner));
    }
  }
  const float* const vertices = full.vertices_mm.front().data();
  constexpr std::size_t kStride = sizeof(Eigen::Vector3f);
  const float scale_mm = meshopt_simplifyScale(vertices, full.vertices_mm.size(), kStride);
  std::vector<unsigned> left(corners.size());
  left.resize(meshopt_simplify(left.data(), corners.data(), corners.size(), vertices, full.vertices_mm.size(),
                               kStride, 0, static_cast<float>(error_mm) / scale_mm,
                               meshopt_SimplifyLockBorder));
  for (std::size_t i = 0; i < left.size(); i += 3)
    triangles.push_back(Eigen::Matrix<unsigned, 3, 1>(&left[i]).cast<int>());
  return submesh(full, triangles);
}

/// Marks the full mesh's vertices around triangles that are too far off.
void keep_around(const Mesh& full, const Mesh& simple, const std::set<std::size_t>& triangles,
                 std::vector<char>& keep_vertex) {
  std::vector<std::pair<Eigen::Vector3f, float>> balls;
  balls.reserve(triangles.size());
  for (const std::size_t t : triangles)
    balls.emplace_back(
        ((corner_of(simple, t, 0) + corner_of(simple, t, 1) + corner_of(simple, t, 2)) / 3).cast<float>(),
        static_cast<float>(kCover * longest_edge_mm(simple, t)));
  parallel_for_ranges(full.vertices_mm.size(), 4096, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v)
      for (const auto& [center_mm, radius_mm] : balls)
        if ((full.vertices_mm[v] - center_mm).squaredNorm() <= radius_mm * radius_mm) keep_vertex[v] = 1;
  });
}

/// Decimates with one bound; puts the full mesh back where the result is too far off. Without triangles when
/// that does not end.
SimplifiedMesh simplify_with_bound(const TriangleScene& full, double bound_mm, double max_error_mm,
                                   double spacing_mm) {
  std::vector<char> keep_vertex(full.mesh().vertices_mm.size(), 0);
  for (int round = 0; round < kRounds; ++round) {
    Mesh mesh = decimate(full.mesh(), bound_mm, keep_vertex);
    if (mesh.triangles.empty()) break;
    const Deviation deviation = measure(full, TriangleScene(mesh), spacing_mm, max_error_mm);
    if (deviation.triangles.empty()) return {std::move(mesh), deviation.largest_mm};
    if (static_cast<double>(deviation.triangles.size()) >
        kMaxPutBack * static_cast<double>(mesh.triangles.size()))
      break;
    keep_around(full.mesh(), mesh, deviation.triangles, keep_vertex);
  }
  return {};
}

}  // namespace

double largest_distance_mm(const TriangleScene& full, const TriangleScene& simple, double spacing_mm) {
  return measure(full, simple, spacing_mm, 0.0).largest_mm;
}

SimplifiedMesh simplify(const Mesh& full, double max_error_mm, ProgressSink& progress) {
  const TriangleScene scene(full);
  const double spacing_mm = typical_edge_mm(full);
  SimplifiedMesh best{full, 0.0};
  ParallelProgress bounds(&progress, "simplifying", kBounds);
  double bound_mm = max_error_mm;
  for (int tried = 0; tried < kBounds && spacing_mm > 0; ++tried, bound_mm *= std::sqrt(0.5)) {
    SimplifiedMesh candidate = simplify_with_bound(scene, bound_mm, max_error_mm, spacing_mm);
    bounds.step();
    if (candidate.mesh.triangles.empty()) continue;
    if (candidate.mesh.triangles.size() >= best.mesh.triangles.size()) break;  // and so will smaller bounds
    best = std::move(candidate);
  }
  bounds.end();
  return best;
}

}  // namespace gelslam
