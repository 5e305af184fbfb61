#include "mesh_checks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "gelslam/evaluation/triangle_scene.hpp"

namespace gelslam::test {

MeshTopology topology(const Mesh& mesh) {
  MeshTopology result;
  result.pieces = static_cast<int>(find_shells(mesh).area_mm2.size());
  std::map<std::pair<int, int>, std::array<int, 2>> uses;  // forward, backward
  for (const auto& t : mesh.triangles)
    for (int c = 0; c < 3; ++c) {
      const int a = t[c], b = t[(c + 1) % 3];
      ++uses[std::minmax(a, b)][a < b ? 0 : 1];
    }
  for (const auto& [edge, use] : uses) {
    const int total = use[0] + use[1];
    result.over_used_edges += total > 2;
    result.inconsistent_edges += total == 2 && use[0] != 1;
    if (total != 1) continue;
    ++result.boundary_edges;
    const auto corner = [&](int i) { return mesh.vertices_mm[static_cast<std::size_t>(i)].cast<double>(); };
    result.boundary_mm += (corner(edge.first) - corner(edge.second)).norm();
  }
  result.euler_number =
      static_cast<int>(mesh.vertices_mm.size() + mesh.triangles.size()) - static_cast<int>(uses.size());
  return result;
}

double stacked_share(const Mesh& mesh, double reach_mm) {
  const TriangleScene scene(mesh);
  int stacked = 0, tested = 0;
  for (std::size_t v = 0; v < mesh.vertices_mm.size(); v += 7, ++tested) {
    const Eigen::Vector3d p = mesh.vertices_mm[v].cast<double>(), n = mesh.normals[v].cast<double>();
    bool is_stacked = false;
    double along_mm = -reach_mm;  // of the ray through the vertex
    for (int hit = 0; !is_stacked && (hit = scene.first_hit(p + along_mm * n, n, reach_mm - along_mm)) >= 0;
         along_mm += 1e-4) {
      const Eigen::Vector3i& corners = mesh.triangles[static_cast<std::size_t>(hit)];
      const Eigen::Vector3d normal = scene.triangle_normal(hit),
                            corner = mesh.vertices_mm[static_cast<std::size_t>(corners[0])].cast<double>();
      along_mm = (corner - p).dot(normal) / n.dot(normal);
      const bool its_own = (corners.array() == static_cast<int>(v)).any();
      is_stacked = !its_own && std::abs(along_mm) >= 0.03 && normal.dot(n) > 0;
    }
    stacked += is_stacked;
  }
  return tested > 0 ? static_cast<double>(stacked) / tested : 0.0;
}

Accuracy accuracy(const Mesh& mesh, const Field& field) {
  Accuracy result;
  const auto count = static_cast<double>(mesh.vertices_mm.size());
  for (std::size_t v = 0; v < mesh.vertices_mm.size(); ++v) {
    const auto [value, gradient] = field(mesh.vertices_mm[v].cast<double>());
    const double error_mm = std::abs(value) / std::max(gradient.norm(), 1e-9);
    result.mean_mm += error_mm / count;
    result.max_mm = std::max(result.max_mm, error_mm);
    const double cosine = gradient.normalized().dot(mesh.normals[v].cast<double>());
    result.normal_mean_rad += std::acos(std::clamp(cosine, -1.0, 1.0)) / count;
  }
  return result;
}

double covered_share(const Mesh& mesh, const std::vector<Eigen::Vector3d>& points, double reach_mm) {
  const auto covered =
      std::ranges::count_if(TriangleScene(mesh).closest(points),
                            [&](const ClosestPoint& found) { return found.distance_mm <= reach_mm; });
  return static_cast<double>(covered) / static_cast<double>(points.size());
}

}  // namespace gelslam::test
