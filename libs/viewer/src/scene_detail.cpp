#include "scene_detail.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace gelslam::viewer::detail {
namespace {

using Eigen::Vector3f;

/// Vertices on an edge that only one triangle has.
std::vector<bool> border_vertices(const DrawableMesh& mesh) {
  std::vector<std::uint64_t> edges;
  edges.reserve(mesh.indices.size());
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    const std::uint64_t a = mesh.indices[i], b = mesh.indices[i % 3 == 2 ? i - 2 : i + 1];
    edges.push_back(std::min(a, b) << 32 | std::max(a, b));
  }
  std::sort(edges.begin(), edges.end());
  std::vector<bool> border(mesh.vertices_mm.size(), false);
  for (std::size_t first = 0; first < edges.size();) {
    std::size_t last = first;
    while (last < edges.size() && edges[last] == edges[first]) ++last;
    if (last - first == 1) border[edges[first] >> 32] = border[edges[first] & 0xFFFFFFFFU] = true;
    first = last;
  }
  return border;
}

struct Cell {
  std::uint32_t chosen = 0;
  float distance2 = 0;
  bool border = false;
};

/// Whether `p` represents its cell better. Ties are broken by coordinates, so that the order of vertices is
/// nothing.
bool is_better(const Cell& cell, const Vector3f& chosen, const Vector3f& p, float distance2, bool border) {
  if (border != cell.border) return border;
  if (distance2 != cell.distance2) return distance2 < cell.distance2;
  return std::lexicographical_compare(p.data(), p.data() + 3, chosen.data(), chosen.data() + 3);
}

}  // namespace

std::vector<std::uint32_t> cluster_vertices(const DrawableMesh& mesh, float cell_mm) {
  const std::vector<bool> border = border_vertices(mesh);
  std::unordered_map<std::uint64_t, std::uint32_t> cell_of_key;
  cell_of_key.reserve(mesh.vertices_mm.size());
  std::vector<Cell> cells;
  std::vector<std::uint32_t> cell_of_vertex(mesh.vertices_mm.size());
  for (std::uint32_t i = 0; i < mesh.vertices_mm.size(); ++i) {
    const Vector3f& p = mesh.vertices_mm[i];
    const Eigen::Vector3d index = (p.cast<double>() / static_cast<double>(cell_mm)).array().floor();
    std::uint64_t key = 0;  // 21 bits each: two cells of one block never share a key
    for (const double k : index)
      key = key << 21 | (static_cast<std::uint64_t>(static_cast<std::int64_t>(k)) & 0x1FFFFF);
    const Vector3f centre = ((index.array() + 0.5) * static_cast<double>(cell_mm)).matrix().cast<float>();
    const float distance2 = (p - centre).squaredNorm();
    const auto [found, is_new] = cell_of_key.try_emplace(key, static_cast<std::uint32_t>(cells.size()));
    cell_of_vertex[i] = found->second;
    if (is_new) {
      cells.push_back({i, distance2, border[i]});
      continue;
    }
    Cell& cell = cells[found->second];
    if (is_better(cell, mesh.vertices_mm[cell.chosen], p, distance2, border[i]))
      cell = {i, distance2, border[i]};
  }
  std::vector<std::uint32_t> indices;
  for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3) {
    const std::uint32_t a = cell_of_vertex[mesh.indices[t]], b = cell_of_vertex[mesh.indices[t + 1]],
                        c = cell_of_vertex[mesh.indices[t + 2]];
    if (a == b || b == c || a == c) continue;
    for (const std::uint32_t cell : {a, b, c}) indices.push_back(cells[cell].chosen);
  }
  return indices;
}

}  // namespace gelslam::viewer::detail
