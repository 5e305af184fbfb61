#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

/// A growing mesh for any number of readers, each of which asks for what has changed since its last call.
/// Thread-safe.
class MeshFeed {
 public:
  using BlockPtr = std::shared_ptr<const MeshBlock>;
  struct Changes {
    /// `version` is to be passed to the next call; `newest` is that of the newest block.
    std::uint64_t version = 0, newest = 0;
    bool cleared = false;  ///< If true, the reader must remove all its blocks before it adds these.
    std::vector<BlockPtr> blocks;
  };

  /// Adds blocks, which replace those with the same key. If `cleared` is true, all earlier blocks are removed
  /// first.
  void add(bool cleared, std::vector<MeshBlock> blocks);
  /// Replaces all blocks by the given mesh.
  void set_whole(const Mesh& mesh);

  /// Returns the blocks that changed after `version` (0: all), up to about `most_vertices` vertices; the next
  /// call returns the rest.
  Changes since(std::uint64_t version, std::size_t most_vertices) const;
  /// Returns all blocks as one mesh. Neighboring blocks do not share vertices.
  Mesh whole() const;

 private:
  void put(BlockPtr block);

  mutable std::mutex mutex_;
  std::map<std::uint64_t, BlockPtr> by_version_;
  std::map<std::int64_t, std::uint64_t> version_of_;  // by the block's key
  std::uint64_t version_ = 0, cleared_at_ = 0;
};

}  // namespace gelslam
