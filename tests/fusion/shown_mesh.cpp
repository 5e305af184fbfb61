#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "mesh_checks.hpp"

namespace gelslam::test {
namespace {

void add_facets(const Mesh& mesh, std::vector<Facet>& facets) {
  for (const Eigen::Vector3i& t : mesh.triangles) {
    Facet facet;
    for (int c = 0; c < 3; ++c) {
      const std::size_t v = static_cast<std::size_t>(t[c]);
      const Eigen::Vector3f &p = mesh.vertices_mm[v], &n = mesh.normals[v];
      facet[static_cast<std::size_t>(c)] = {p.x(), p.y(), p.z(), n.x(), n.y(), n.z(), mesh.confidence[v]};
    }
    std::rotate(facet.begin(), std::min_element(facet.begin(), facet.end()), facet.end());
    facets.push_back(facet);
  }
}

}  // namespace

void Shown::take(IncrementalFusion& fusion) {
  std::int64_t last = std::numeric_limits<std::int64_t>::min();
  for (MeshBlock& block : fusion.take_changed_blocks()) {
    EXPECT_GT(block.key, last);
    last = block.key;
    ++changes_;
    if (block.mesh.triangles.empty()) {
      EXPECT_EQ(blocks_.erase(block.key), 1u);
    } else {
      blocks_.insert_or_assign(block.key, std::move(block));
    }
  }
}

void Shown::finish(IncrementalFusion& fusion) {
  while (fusion.work()) take(fusion);
  take(fusion);
}

void Shown::show(IncrementalFusion& fusion, const std::vector<PosedSurface>& patches, double gradient_scale) {
  fusion.set_patches(patches, gradient_scale);
  finish(fusion);
}

std::vector<Facet> facets_of(const Mesh& mesh) {
  std::vector<Facet> facets;
  add_facets(mesh, facets);
  std::sort(facets.begin(), facets.end());
  return facets;
}

std::vector<Facet> facets_of(const Shown& shown) {
  std::vector<Facet> facets;
  for (const auto& [key, block] : shown.blocks()) add_facets(block.mesh, facets);
  std::sort(facets.begin(), facets.end());
  return facets;
}

Mesh welded(const Shown& shown) {
  Mesh mesh;
  std::map<std::array<float, 3>, int> index;
  const auto weld = [&](const Mesh& from, int v) {
    const Eigen::Vector3f &p = from.vertices_mm[static_cast<std::size_t>(v)],
                          &n = from.normals[static_cast<std::size_t>(v)];
    const auto [at, added] = index.try_emplace({p.x(), p.y(), p.z()}, static_cast<int>(index.size()));
    if (added) {
      mesh.vertices_mm.push_back(p);
      mesh.normals.push_back(n);
    } else {
      EXPECT_EQ(mesh.normals[static_cast<std::size_t>(at->second)], n);
    }
    return at->second;
  };
  for (const auto& [key, block] : shown.blocks()) {
    for (const Eigen::Vector3i& t : block.mesh.triangles)
      mesh.triangles.emplace_back(weld(block.mesh, t[0]), weld(block.mesh, t[1]), weld(block.mesh, t[2]));
  }
  return mesh;
}

}  // namespace gelslam::test
