#pragma once

#include <cstdint>
#include <filesystem>
#include <future>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "gelslam/slam/live_session.hpp"

namespace gelslam::viewer::detail {

/// A mesh in blocks, at one time. Immutable, and cheap to copy.
using MeshBlocks = std::map<std::int64_t, std::shared_ptr<const Mesh>>;

/// The blocks of the growing mesh as they came, at full resolution, for exports.
class WindowMesh {
 public:
  void update(MeshChanges changes);
  std::size_t triangles() const { return triangles_; }
  const MeshBlocks& blocks() const { return blocks_; }

 private:
  MeshBlocks blocks_;
  std::size_t triangles_ = 0;
};

/// One mesh of all blocks; vertices on a border between two, which both have, are one again.
Mesh join_blocks(const MeshBlocks& blocks);

/// What became of an export: the sentence for a toast. `ok` is false when the sentence is a complaint.
struct ExportOutcome {
  bool ok = true;
  std::string sentence;
};
/// "mesh_mm_001.stl", or "mesh_001.ply" in meters: the same rule for units as `gelslam export`.
std::filesystem::path export_path(const std::filesystem::path& folder, const std::string& extension);
/// Joins and writes a mesh on a thread of its own, while the window goes on drawing.
std::future<ExportOutcome> export_in_background(MeshBlocks blocks, const std::filesystem::path& path);
}  // namespace gelslam::viewer::detail
