#include "mesh_checks.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <unordered_map>

namespace gelslam::test {
namespace {

std::size_t index(int i) { return static_cast<std::size_t>(i); }

std::int64_t cell_key(const Eigen::Vector3f& p, float size) {
  std::int64_t key = 0;
  for (int axis = 0; axis < 3; ++axis)
    key = key * 1000003 + static_cast<std::int64_t>(std::floor(p[axis] / size));
  return key;
}

using CellMap = std::unordered_map<std::int64_t, std::vector<int>>;

template <typename Visit>
void visit_around(const CellMap& cells, const Eigen::Vector3f& p, float size, Visit&& visit) {
  for (int n = 0; n < 27; ++n) {
    const Eigen::Vector3f step(static_cast<float>(n % 3 - 1), static_cast<float>(n / 3 % 3 - 1),
                               static_cast<float>(n / 9 - 1));
    const auto found = cells.find(cell_key(p + size * step, size));
    if (found == cells.end()) continue;
    for (const int i : found->second) visit(i);
  }
}

/// Distance along the line p + s n at which it meets the triangle, if it does.
bool meets(const Eigen::Vector3f& p, const Eigen::Vector3f& n, const std::array<Eigen::Vector3f, 3>& t,
           float& s) {
  const Eigen::Vector3f e1 = t[1] - t[0], e2 = t[2] - t[0], h = n.cross(e2);
  const float det = e1.dot(h);
  if (std::fabs(det) < 1e-12f) return false;
  const Eigen::Vector3f r = p - t[0], q = r.cross(e1);
  const float u = r.dot(h) / det, v = n.dot(q) / det;
  s = e2.dot(q) / det;
  return u >= 0 && v >= 0 && u + v <= 1;
}

}  // namespace

MeshTopology topology(const Mesh& mesh) {
  MeshTopology result;
  std::map<std::pair<int, int>, std::array<int, 2>> uses;  // forward, backward
  std::vector<int> parent(mesh.vertices_mm.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int v) {
    while (parent[index(v)] != v) v = parent[index(v)] = parent[index(parent[index(v)])];
    return v;
  };
  for (const auto& t : mesh.triangles) {
    for (int c = 0; c < 3; ++c) {
      const int a = t[c], b = t[(c + 1) % 3];
      ++uses[std::minmax(a, b)][a < b ? 0 : 1];
      parent[index(root(a))] = root(b);
    }
  }
  for (int v = 0; v < static_cast<int>(parent.size()); ++v) result.pieces += root(v) == v;
  for (const auto& [edge, use] : uses) {
    const int total = use[0] + use[1];
    result.boundary_edges += total == 1;
    result.over_used_edges += total > 2;
    result.inconsistent_edges += total == 2 && use[0] != 1;
  }
  return result;
}

double stacked_share(const Mesh& mesh, double reach_mm) {
  const float size = static_cast<float>(reach_mm) + 0.15f;
  CellMap triangles;
  const auto corner = [&](const Eigen::Vector3i& t, int c) { return mesh.vertices_mm[index(t[c])]; };
  for (int i = 0; i < static_cast<int>(mesh.triangles.size()); ++i) {
    const auto& t = mesh.triangles[index(i)];
    triangles[cell_key((corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3.0f, size)].push_back(i);
  }
  int stacked = 0, tested = 0;
  for (std::size_t v = 0; v < mesh.vertices_mm.size(); v += 7, ++tested) {
    const Eigen::Vector3f p = mesh.vertices_mm[v], n = mesh.normals[v];
    bool found = false;
    visit_around(triangles, p, size, [&](int i) {
      const auto& t = mesh.triangles[index(i)];
      if (found || t[0] == static_cast<int>(v) || t[1] == static_cast<int>(v) || t[2] == static_cast<int>(v))
        return;
      float s = 0;
      const std::array<Eigen::Vector3f, 3> corners{corner(t, 0), corner(t, 1), corner(t, 2)};
      if (!meets(p, n, corners, s) || std::fabs(s) < 0.03f || std::fabs(s) > static_cast<float>(reach_mm))
        return;
      found = (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(n) > 0;
    });
    stacked += found;
  }
  return tested > 0 ? static_cast<double>(stacked) / tested : 0.0;
}

Accuracy accuracy(const Mesh& mesh, const Shape& shape) {
  Accuracy result;
  const auto count = static_cast<double>(mesh.vertices_mm.size());
  for (std::size_t v = 0; v < mesh.vertices_mm.size(); ++v) {
    const Eigen::Vector3d p = mesh.vertices_mm[v].cast<double>();
    const double error_mm = std::fabs(surface_distance(shape, p));
    result.mean_mm += error_mm / count;
    result.max_mm = std::max(result.max_mm, error_mm);
    const double cosine = outward_normal(shape, p).dot(mesh.normals[v].cast<double>());
    result.normal_mean_rad += std::acos(std::clamp(cosine, -1.0, 1.0)) / count;
  }
  return result;
}

double covered_share(const Mesh& mesh, const std::vector<Eigen::Vector3d>& points, double reach_mm) {
  const float size = static_cast<float>(reach_mm);
  CellMap vertices;
  for (int i = 0; i < static_cast<int>(mesh.vertices_mm.size()); ++i) {
    vertices[cell_key(mesh.vertices_mm[index(i)], size)].push_back(i);
  }
  int covered = 0;
  for (const auto& point : points) {
    const Eigen::Vector3f p = point.cast<float>();
    bool found = false;
    visit_around(vertices, p, size,
                 [&](int i) { found = found || (mesh.vertices_mm[index(i)] - p).norm() <= size; });
    covered += found;
  }
  return points.empty() ? 0.0 : static_cast<double>(covered) / static_cast<double>(points.size());
}

}  // namespace gelslam::test
