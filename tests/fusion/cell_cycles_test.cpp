#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "block_mesher.hpp"

namespace gelslam::fusion::detail {
namespace {

std::vector<int> cycle_sizes(unsigned outside) {
  const CellCycles& cycles = cell_cycles(static_cast<std::uint8_t>(outside));
  std::vector<int> sizes(static_cast<std::size_t>(cycles.count), 0);
  for (const std::int8_t cycle : cycles.of_edge) {
    if (cycle >= 0) ++sizes[static_cast<std::size_t>(cycle)];
  }
  std::sort(sizes.begin(), sizes.end());
  return sizes;
}

TEST(CellCycles, EveryCrossedEdgeLiesOnOneClosedCycle) {
  for (unsigned outside = 0; outside < 256; ++outside) {
    const CellCycles& cycles = cell_cycles(static_cast<std::uint8_t>(outside));
    for (std::size_t e = 0; e < 12; ++e) {
      const CellEdge& edge = cell_edges()[e];
      const bool crossed = ((outside >> edge.from) & 1) != ((outside >> edge.to) & 1);
      EXPECT_EQ(cycles.of_edge[e] >= 0, crossed) << outside << " edge " << e;
    }
    // A closed cycle through the faces of a cube has at least three edges, and four such cycles fill its
    // twelve.
    EXPECT_LE(cycles.count, 4) << outside;
    for (const int size : cycle_sizes(outside)) EXPECT_GE(size, 3) << outside;
  }
}

TEST(CellCycles, AmbiguousFacesKeepTheInsideConnected) {
  using Sizes = std::vector<int>;
  EXPECT_EQ(cycle_sizes(0b00000001), (Sizes{3}));     // one corner
  EXPECT_EQ(cycle_sizes(0b00001111), (Sizes{4}));     // one face
  EXPECT_EQ(cycle_sizes(0b10000001), (Sizes{3, 3}));  // opposite corners of the cell
  EXPECT_EQ(cycle_sizes(0b00001001), (Sizes{3, 3}));  // a face's diagonal outside: cut off one by one
  EXPECT_EQ(cycle_sizes(0b11110110), (Sizes{6}));     // the same diagonal inside: one sheet around both
  EXPECT_EQ(cycle_sizes(0b01101001), (Sizes{3, 3, 3, 3}));
}

}  // namespace
}  // namespace gelslam::fusion::detail
