#include "pieces.hpp"

#include <Eigen/Geometry>
#include <numeric>

namespace gelslam::fusion::detail {
namespace {

std::size_t index(int i) { return static_cast<std::size_t>(i); }

int find_root(std::vector<int>& parent, int v) {
  while (parent[index(v)] != v) {
    parent[index(v)] = parent[index(parent[index(v)])];
    v = parent[index(v)];
  }
  return v;
}

}  // namespace

Mesh without_small_pieces(const Mesh& mesh, double min_area_mm2) {
  const auto& p = mesh.vertices_mm;
  std::vector<int> parent(p.size());
  std::iota(parent.begin(), parent.end(), 0);
  for (const auto& t : mesh.triangles) {
    const int a = find_root(parent, t[0]);
    parent[index(find_root(parent, t[1]))] = a;
    parent[index(find_root(parent, t[2]))] = a;
  }
  std::vector<double> area_mm2(p.size(), 0.0);
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3f across = (p[index(t[1])] - p[index(t[0])]).cross(p[index(t[2])] - p[index(t[0])]);
    area_mm2[index(find_root(parent, t[0]))] += 0.5 * static_cast<double>(across.norm());
  }
  Mesh kept;
  std::vector<int> new_index(p.size(), -1);
  for (const auto& t : mesh.triangles) {
    if (area_mm2[index(find_root(parent, t[0]))] < min_area_mm2) continue;
    for (int c = 0; c < 3; ++c) new_index[index(t[c])] = 0;
  }
  int next = 0;
  for (std::size_t v = 0; v < p.size(); ++v) {
    if (new_index[v] < 0) continue;
    new_index[v] = next++;
    kept.vertices_mm.push_back(p[v]);
    kept.normals.push_back(mesh.normals[v]);
    kept.confidence.push_back(mesh.confidence[v]);
  }
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3i renamed(new_index[index(t[0])], new_index[index(t[1])], new_index[index(t[2])]);
    if (renamed[0] >= 0) kept.triangles.push_back(renamed);
  }
  return kept;
}

}  // namespace gelslam::fusion::detail
