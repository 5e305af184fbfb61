#pragma once

#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

namespace gelslam {

/// Converts an identifier or a signed count to an index into a container. It must not be negative.
constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

/// Disjoint sets over 0..n-1. The root of a set is always its smallest member, so that the numbering of
/// components does not depend on the order of the edges.
class UnionFind {
 public:
  explicit UnionFind(int size) : parent_(static_cast<std::size_t>(size)) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  int root(int i) {
    while (at(i) != i) {
      at(i) = at(at(i));
      i = at(i);
    }
    return i;
  }

  void join(int a, int b) {
    a = root(a);
    b = root(b);
    if (b < a) std::swap(a, b);
    at(b) = a;
  }

 private:
  int& at(int i) { return parent_[static_cast<std::size_t>(i)]; }

  std::vector<int> parent_;
};

}  // namespace gelslam
