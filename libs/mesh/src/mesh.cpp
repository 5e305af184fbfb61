#include "gelslam/mesh/mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "gelslam/core/error.hpp"
#include "gelslam/core/index.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam {

std::array<Eigen::Vector3d, 3> corners_mm(const Mesh& mesh, const Eigen::Vector3i& triangle) {
  std::array<Eigen::Vector3d, 3> corners;
  for (std::size_t k = 0; k < 3; ++k)
    corners[k] = mesh.vertices_mm[static_cast<std::size_t>(triangle[static_cast<int>(k)])].cast<double>();
  return corners;
}

Eigen::Vector3d area_normal(const Mesh& mesh, const Eigen::Vector3i& triangle) {
  const auto [a, b, c] = corners_mm(mesh, triangle);
  return (b - a).cross(c - a);
}

double area_mm2(const Mesh& mesh) {
  double sum = 0;
  for (const Eigen::Vector3i& t : mesh.triangles) sum += 0.5 * area_normal(mesh, t).norm();
  return sum;
}

double volume_mm3(const Mesh& mesh) {
  double sum = 0;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto [a, b, c] = corners_mm(mesh, t);
    sum += a.dot(b.cross(c)) / 6.0;
  }
  return sum;
}

void check_measurable(const Mesh& mesh) {
  if (mesh.triangles.empty()) throw Error("the mesh has no triangles: nothing to measure");
  constexpr double kFurthestVertexMm = 10e3;
  float furthest_mm = 0;
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm) {
    if (!vertex.allFinite()) throw Error("the mesh has a vertex that is not finite");
    furthest_mm = std::max(furthest_mm, vertex.cwiseAbs().maxCoeff());
  }
  if (furthest_mm > kFurthestVertexMm)
    throw Error("the mesh reaches " + short_number(1e-3 * static_cast<double>(furthest_mm), 3) +
                " m from its origin, more than can be measured (" + short_number(1e-3 * kFurthestVertexMm) +
                " m); is its unit right?");
  const auto count = static_cast<std::int64_t>(mesh.vertices_mm.size());
  for (const Eigen::Vector3i& triangle : mesh.triangles)
    if (triangle.minCoeff() < 0 || triangle.maxCoeff() >= count)
      throw Error("a triangle of the mesh names a vertex that does not exist");
}

std::string size_warning(const Mesh& mesh) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm) box.extend(vertex);
  const double size_mm = static_cast<double>(box.diagonal().norm());
  if (size_mm >= 1 && size_mm <= 2000) return "";
  return "is " + short_number(size_mm) + " mm large; check its unit";
}

double typical_edge_mm(const Mesh& mesh) {
  std::vector<double> edges_mm;
  edges_mm.reserve(3 * mesh.triangles.size());
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto [a, b, c] = corners_mm(mesh, t);
    edges_mm.insert(edges_mm.end(), {(a - b).norm(), (b - c).norm(), (c - a).norm()});
  }
  if (edges_mm.empty()) return 0.0;
  return std::max(median(std::move(edges_mm)),
                  std::sqrt(area_mm2(mesh) / (4.0 * static_cast<double>(mesh.vertices_mm.size()))));
}

MeshShells find_shells(const Mesh& mesh) {
  UnionFind vertices(static_cast<int>(mesh.vertices_mm.size()));
  for (const Eigen::Vector3i& t : mesh.triangles)
    for (const int corner : {t[1], t[2]}) vertices.join(corner, t[0]);
  MeshShells shells;
  std::map<int, int> shell_of_root;
  double total_mm2 = 0;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto next = static_cast<int>(shells.area_mm2.size());
    const auto [place, is_new] = shell_of_root.emplace(vertices.root(t[0]), next);
    if (is_new) shells.area_mm2.push_back(0);
    shells.of_triangle.push_back(place->second);
    const double area_mm2 = 0.5 * area_normal(mesh, t).norm();
    shells.area_mm2[static_cast<std::size_t>(place->second)] += area_mm2;
    total_mm2 += area_mm2;
  }
  const auto largest = std::max_element(shells.area_mm2.begin(), shells.area_mm2.end());
  if (largest == shells.area_mm2.end()) return shells;
  shells.largest = static_cast<int>(largest - shells.area_mm2.begin());
  if (total_mm2 > 0) shells.largest_share = *largest / total_mm2;
  return shells;
}

Mesh largest_shell(const Mesh& mesh) {
  const MeshShells shells = find_shells(mesh);
  std::vector<Eigen::Vector3i> triangles;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    if (shells.of_triangle[i] == shells.largest) triangles.push_back(mesh.triangles[i]);
  return submesh(mesh, triangles);
}

Mesh submesh(const Mesh& mesh, const std::vector<Eigen::Vector3i>& triangles) {
  // The vertices of a part of a large mesh are a short range of indices, so it is cut out without a pass over
  // all vertices.
  int first = static_cast<int>(mesh.vertices_mm.size()), end = 0;
  for (const Eigen::Vector3i& t : triangles) {
    first = std::min(first, t.minCoeff());
    end = std::max(end, t.maxCoeff() + 1);
  }
  std::vector<int> kept(static_cast<std::size_t>(std::max(end - first, 0)), -1);
  for (const Eigen::Vector3i& t : triangles)
    for (const int corner : t) kept[index(corner - first)] = 0;
  const auto vertices = static_cast<std::size_t>(std::count(kept.begin(), kept.end(), 0));
  Mesh result;
  result.vertices_mm.reserve(vertices);
  if (!mesh.normals.empty()) result.normals.reserve(vertices);
  if (!mesh.confidence.empty()) result.confidence.reserve(vertices);
  result.triangles.reserve(triangles.size());
  for (int v = first; v < end; ++v) {
    if (kept[index(v - first)] < 0) continue;
    kept[index(v - first)] = static_cast<int>(result.vertices_mm.size());
    result.vertices_mm.push_back(mesh.vertices_mm[index(v)]);
    if (!mesh.normals.empty()) result.normals.push_back(mesh.normals[index(v)]);
    if (!mesh.confidence.empty()) result.confidence.push_back(mesh.confidence[index(v)]);
  }
  const auto moved = [&](int corner) { return kept[index(corner - first)]; };
  for (const Eigen::Vector3i& t : triangles) result.triangles.push_back(t.unaryExpr(moved));
  return result;
}

}  // namespace gelslam
