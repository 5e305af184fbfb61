#include "gelslam/slam/mesh_feed.hpp"

#include <algorithm>

namespace gelslam {
namespace {

constexpr std::size_t kTrianglesOfPart = 20'000;

}  // namespace

void MeshFeed::put(BlockPtr block) {
  std::uint64_t& version = version_of_[block->key];
  by_version_.erase(version);
  version = ++version_;
  by_version_.emplace(version, std::move(block));
}

void MeshFeed::add(bool cleared, std::vector<MeshBlock> blocks) {
  const std::lock_guard lock(mutex_);
  if (cleared) {
    by_version_.clear();
    version_of_.clear();
    cleared_at_ = ++version_;
  }
  for (MeshBlock& block : blocks) put(std::make_shared<const MeshBlock>(std::move(block)));
}

void MeshFeed::set_whole(const Mesh& mesh) {
  std::vector<MeshBlock> parts;
  for (auto begin = mesh.triangles.begin(); begin != mesh.triangles.end();) {
    const auto left = static_cast<std::size_t>(mesh.triangles.end() - begin);
    const auto end = begin + static_cast<std::ptrdiff_t>(std::min(left, kTrianglesOfPart));
    parts.push_back({static_cast<std::int64_t>(parts.size()), submesh(mesh, {begin, end}), {}});
    begin = end;
  }
  add(true, std::move(parts));
}

MeshFeed::Changes MeshFeed::since(std::uint64_t version, std::size_t most_vertices) const {
  const std::lock_guard lock(mutex_);
  // A version larger than the newest one was given out by an earlier run of the program.
  Changes changes{version, version_, version < cleared_at_ || version > version_, {}};
  if (changes.cleared) changes.version = cleared_at_;
  std::size_t vertices = 0;
  for (auto next = by_version_.upper_bound(changes.version); next != by_version_.end(); ++next) {
    if (vertices > 0 && vertices + next->second->mesh.vertices_mm.size() > most_vertices) break;
    vertices += next->second->mesh.vertices_mm.size();
    changes.version = next->first;
    changes.blocks.push_back(next->second);
  }
  return changes;
}

Mesh MeshFeed::whole() const {
  const Changes all = since(0, SIZE_MAX);
  Mesh mesh;
  for (const BlockPtr& block : all.blocks) {
    const int first = static_cast<int>(mesh.vertices_mm.size());
    const Mesh& part = block->mesh;
    mesh.vertices_mm.insert(mesh.vertices_mm.end(), part.vertices_mm.begin(), part.vertices_mm.end());
    mesh.normals.insert(mesh.normals.end(), part.normals.begin(), part.normals.end());
    mesh.confidence.insert(mesh.confidence.end(), part.confidence.begin(), part.confidence.end());
    for (const Eigen::Vector3i& triangle : part.triangles) mesh.triangles.push_back(triangle.array() + first);
  }
  return mesh;
}

}  // namespace gelslam
