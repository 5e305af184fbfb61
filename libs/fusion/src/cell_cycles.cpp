// For each of the 256 sign patterns of a cell's corners: the crossed edges, joined to closed cycles (Nielson,
// "Dual marching cubes", IEEE Visualization 2004). On each face with two crossed edges, these belong to the
// same cycle. On a face with four, each outside corner is cut off separately, which joins the two edges at
// that corner.

#include <numeric>

#include "block_mesher.hpp"

namespace gelslam::fusion::detail {
namespace {

std::array<CellEdge, 12> make_edges() {
  std::array<CellEdge, 12> edges{};
  for (int axis = 0; axis < 3; ++axis) {
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    for (int i = 0; i < 4; ++i) {
      const int from = ((i & 1) << b) | ((i >> 1) << c);
      edges[static_cast<std::size_t>(4 * axis + i)] = {from, from | (1 << axis)};
    }
  }
  return edges;
}

int edge_between(int corner_a, int corner_b) {
  const auto& edges = cell_edges();
  for (int e = 0; e < 12; ++e) {
    const CellEdge& edge = edges[static_cast<std::size_t>(e)];
    if ((edge.from == corner_a && edge.to == corner_b) || (edge.from == corner_b && edge.to == corner_a))
      return e;
  }
  return -1;
}

class EdgeSets {
 public:
  EdgeSets() { std::iota(parent_.begin(), parent_.end(), 0); }
  int find(int e) const {
    while (parent_[static_cast<std::size_t>(e)] != e) e = parent_[static_cast<std::size_t>(e)];
    return e;
  }
  void join(int a, int b) { parent_[static_cast<std::size_t>(find(a))] = find(b); }

 private:
  std::array<int, 12> parent_{};
};

void join_across_face(int axis, int side, std::uint8_t outside, EdgeSets& sets) {
  const int b = 1 << ((axis + 1) % 3), c = 1 << ((axis + 2) % 3), base = side << axis;
  const std::array<int, 4> corners{base, base | b, base | b | c, base | c};
  const auto is_outside = [&](int i) {
    return ((outside >> corners[static_cast<std::size_t>(i & 3)]) & 1) != 0;
  };
  const auto edge = [&](int i) {
    return edge_between(corners[static_cast<std::size_t>(i & 3)],
                        corners[static_cast<std::size_t>((i + 1) & 3)]);
  };
  std::array<int, 4> crossed{};
  std::size_t crossings = 0;
  for (int i = 0; i < 4; ++i)
    if (is_outside(i) != is_outside(i + 1)) crossed[crossings++] = edge(i);
  if (crossings == 2) sets.join(crossed[0], crossed[1]);
  if (crossings == 4) {
    const int first = is_outside(0) ? 0 : 1;  // Each outside corner is cut off separately.
    sets.join(edge(first + 3), edge(first));
    sets.join(edge(first + 1), edge(first + 2));
  }
}

CellCycles make_cycles(std::uint8_t outside) {
  EdgeSets sets;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) join_across_face(axis, side, outside, sets);
  CellCycles cycles;
  std::array<int, 12> number;
  number.fill(-1);
  for (int e = 0; e < 12; ++e) {
    const CellEdge& edge = cell_edges()[static_cast<std::size_t>(e)];
    const bool crossed = ((outside >> edge.from) & 1) != ((outside >> edge.to) & 1);
    int& n = number[static_cast<std::size_t>(sets.find(e))];
    if (crossed && n < 0) n = cycles.count++;
    cycles.of_edge[static_cast<std::size_t>(e)] = static_cast<std::int8_t>(crossed ? n : -1);
  }
  return cycles;
}

}  // namespace

const std::array<CellEdge, 12>& cell_edges() {
  static const std::array<CellEdge, 12> edges = make_edges();
  return edges;
}

const CellCycles& cell_cycles(std::uint8_t outside) {
  static const std::array<CellCycles, 256> table = [] {
    std::array<CellCycles, 256> all;
    for (int i = 0; i < 256; ++i)
      all[static_cast<std::size_t>(i)] = make_cycles(static_cast<std::uint8_t>(i));
    return all;
  }();
  return table[outside];
}

}  // namespace gelslam::fusion::detail
