#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "scene/scene_geometry.hpp"

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

/// The cell of a grid fixed in space: 21 bits for each axis, so that two cells of one block never share a
/// key.
std::uint64_t key_of_cell(const Vector3f& p, float cell_mm) {
  std::uint64_t key = 0;
  for (const float x : p) {
    const double index = std::floor(static_cast<double>(x) / static_cast<double>(cell_mm));
    key = key << 21 | (static_cast<std::uint64_t>(static_cast<std::int64_t>(index)) & 0x1FFFFF);
  }
  return key;
}

struct Cell {
  Vector3f sum_mm = Vector3f::Zero();
  std::uint32_t count = 0, chosen = 0;
  float distance2 = std::numeric_limits<float>::infinity();
};

constexpr std::uint32_t kBorder = std::numeric_limits<std::uint32_t>::max();

}  // namespace

std::vector<std::uint32_t> cluster_vertices(const DrawableMesh& mesh, float cell_mm) {
  const std::vector<bool> border = border_vertices(mesh);
  std::unordered_map<std::uint64_t, std::uint32_t> cell_of_key;
  cell_of_key.reserve(mesh.vertices_mm.size());
  std::vector<Cell> cells;
  std::vector<std::uint32_t> cell_of_vertex(mesh.vertices_mm.size(), kBorder);
  for (std::uint32_t i = 0; i < mesh.vertices_mm.size(); ++i) {
    if (border[i]) continue;
    const std::uint64_t key = key_of_cell(mesh.vertices_mm[i], cell_mm);
    cell_of_vertex[i] = cell_of_key.try_emplace(key, static_cast<std::uint32_t>(cells.size())).first->second;
    if (cell_of_vertex[i] == cells.size()) cells.emplace_back();
    Cell& cell = cells[cell_of_vertex[i]];
    cell.sum_mm += mesh.vertices_mm[i];
    ++cell.count;
  }
  // The vertex nearest to the mean of its cell stands for it.
  for (std::uint32_t i = 0; i < mesh.vertices_mm.size(); ++i) {
    if (border[i]) continue;
    Cell& cell = cells[cell_of_vertex[i]];
    const float distance2 =
        (mesh.vertices_mm[i] - cell.sum_mm / static_cast<float>(cell.count)).squaredNorm();
    if (distance2 < cell.distance2) cell.distance2 = distance2, cell.chosen = i;
  }
  const auto stand_in = [&](std::uint32_t vertex) {
    return cell_of_vertex[vertex] == kBorder ? vertex : cells[cell_of_vertex[vertex]].chosen;
  };
  std::vector<std::uint32_t> indices;
  for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3) {
    const std::uint32_t a = stand_in(mesh.indices[t]), b = stand_in(mesh.indices[t + 1]),
                        c = stand_in(mesh.indices[t + 2]);
    if (a != b && b != c && a != c) indices.insert(indices.end(), {a, b, c});
  }
  return indices;
}

}  // namespace gelslam::viewer::detail
