#include "live/mesh_export.hpp"

#include <system_error>
#include <unordered_map>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/mesh/point_bits.hpp"
#include "gelslam/viewer/window_host.hpp"
#include "live/status_text.hpp"

namespace gelslam::viewer::detail {
namespace {

/// Vertices at exactly the same place are one.
class MeshJoiner {
 public:
  void add(const Mesh& block) {
    std::vector<int> index(block.vertices_mm.size());
    for (std::size_t i = 0; i < index.size(); ++i) index[i] = vertex(block, i);
    for (const Eigen::Vector3i& t : block.triangles) {
      const Eigen::Vector3i joined(at(index, t.x()), at(index, t.y()), at(index, t.z()));
      if (joined.minCoeff() >= 0 && joined.x() != joined.y() && joined.y() != joined.z() &&
          joined.z() != joined.x())
        mesh_.triangles.push_back(joined);
    }
  }

  Mesh take() {
    const std::size_t vertices = mesh_.vertices_mm.size();
    if (mesh_.normals.size() != vertices) mesh_.normals.clear();  // a block had none
    if (mesh_.confidence.size() != vertices) mesh_.confidence.clear();
    return std::move(mesh_);
  }

 private:
  static int at(const std::vector<int>& index, int i) {
    return i >= 0 && static_cast<std::size_t>(i) < index.size() ? index[static_cast<std::size_t>(i)] : -1;
  }

  int vertex(const Mesh& block, std::size_t i) {
    const auto next = static_cast<int>(mesh_.vertices_mm.size());
    const auto [place, is_new] = known_.emplace(bits_of(block.vertices_mm[i]), next);
    if (!is_new) return place->second;
    mesh_.vertices_mm.push_back(block.vertices_mm[i]);
    if (i < block.normals.size()) mesh_.normals.push_back(block.normals[i]);
    if (i < block.confidence.size()) mesh_.confidence.push_back(block.confidence[i]);
    return next;
  }

  Mesh mesh_;
  std::unordered_map<PointBits, int, PointBitsHash> known_;
};

ExportOutcome export_now(const Mesh& mesh, const std::filesystem::path& path) {
  if (mesh.triangles.empty()) return {false, "There is no mesh to export yet."};
  try {
    std::error_code ignored;  // write_mesh says what is wrong with the folder
    std::filesystem::create_directories(path.parent_path(), ignored);
    write_mesh(path, mesh, usual_unit(path));
  } catch (const Error& error) {
    return {false, error.what()};
  }
  return {true,
          "Mesh (" + text_of_count(static_cast<std::int64_t>(mesh.triangles.size())) +
              (usual_unit(path) == LengthUnit::meter ? " triangles, in meters): " : " triangles, in mm): ") +
              path.string()};
}

}  // namespace

void WindowMesh::update(MeshChanges changes) {
  if (changes.cleared) {
    blocks_.clear();
    triangles_ = 0;
  }
  for (MeshBlock& block : changes.blocks) {
    if (const auto old = blocks_.find(block.key); old != blocks_.end()) {
      triangles_ -= old->second->triangles.size();
      blocks_.erase(old);
    }
    if (block.mesh.triangles.empty()) continue;
    triangles_ += block.mesh.triangles.size();
    blocks_.emplace(block.key, std::make_shared<const Mesh>(std::move(block.mesh)));
  }
}

Mesh join_blocks(const MeshBlocks& blocks) {
  MeshJoiner joiner;
  for (const auto& [key, block] : blocks) joiner.add(*block);
  return joiner.take();
}

std::filesystem::path export_path(const std::filesystem::path& folder, const std::string& extension) {
  return free_name(folder, usual_unit("a." + extension) == LengthUnit::meter ? "mesh" : "mesh_mm", extension);
}

std::future<ExportOutcome> export_in_background(MeshBlocks blocks, const std::filesystem::path& path) {
  return std::async(std::launch::async, [blocks = std::move(blocks), path] {
    lower_thread_priority();
    return export_now(join_blocks(blocks), path);
  });
}

}  // namespace gelslam::viewer::detail
