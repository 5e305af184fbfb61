#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <utility>

#include "gelslam/mesh/mesh.hpp"

namespace gelslam::test {

using Height = std::function<double(double x, double y)>;

/// A height field over [x0, x1] x [y0, y1] with `cells` x `cells` squares, facing +z.
inline Mesh height_field(double x0, double x1, double y0, double y1, int cells, const Height& height) {
  Mesh mesh;
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      const double x = x0 + (x1 - x0) * i / cells, y = y0 + (y1 - y0) * j / cells;
      mesh.vertices_mm.emplace_back(Eigen::Vector3d(x, y, height(x, y)).cast<float>());
    }
  }
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      const int a = j * (cells + 1) + i, b = a + 1, c = a + cells + 1, d = c + 1;
      mesh.triangles.emplace_back(a, b, d);
      mesh.triangles.emplace_back(a, d, c);
    }
  }
  return mesh;
}

inline Mesh plane(double z, int cells = 10, double size = 10.0) {
  return height_field(-size / 2, size / 2, -size / 2, size / 2, cells, [z](double, double) { return z; });
}

/// Bumps that no rigid motion maps onto themselves.
inline double bumps(double x, double y) {
  return 0.5 * std::sin(0.9 * x + 0.3) * std::cos(1.3 * y) + 0.2 * std::sin(2.1 * y + 0.5 * x);
}

inline Mesh sphere(double radius, int slices = 128) {
  Mesh mesh;
  const int stacks = slices / 2;
  for (int j = 0; j <= stacks; ++j) {
    for (int i = 0; i < slices; ++i) {
      const double polar = std::numbers::pi * j / stacks, around = 2.0 * std::numbers::pi * i / slices;
      mesh.vertices_mm.emplace_back(
          (radius * Eigen::Vector3d(std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around),
                                    std::cos(polar)))
              .cast<float>());
    }
  }
  for (int j = 0; j < stacks; ++j) {
    for (int i = 0; i < slices; ++i) {
      const int a = j * slices + i, b = j * slices + (i + 1) % slices;
      mesh.triangles.emplace_back(a, a + slices, b + slices);
      mesh.triangles.emplace_back(a, b + slices, b);
    }
  }
  return mesh;
}

inline Mesh joined(Mesh first, const Mesh& second) {
  const int offset = static_cast<int>(first.vertices_mm.size());
  first.vertices_mm.insert(first.vertices_mm.end(), second.vertices_mm.begin(), second.vertices_mm.end());
  for (const Eigen::Vector3i& t : second.triangles) first.triangles.emplace_back(t.array() + offset);
  return first;
}

/// Edges that are not used as often in one direction as in the other, or more than `most` times: none in a
/// closed surface.
inline int open_or_tangled_edges(const Mesh& mesh, int most = 1) {
  std::map<std::pair<int, int>, int> edges;
  for (const Eigen::Vector3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  return static_cast<int>(std::ranges::count_if(edges, [&](const auto& edge) {
    const auto back = edges.find({edge.first.second, edge.first.first});
    return edge.second > most || back == edges.end() || back->second != edge.second;
  }));
}

inline Mesh flipped(Mesh mesh) {
  for (Eigen::Vector3i& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

}  // namespace gelslam::test
