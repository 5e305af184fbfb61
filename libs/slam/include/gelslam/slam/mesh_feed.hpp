#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

/// A growing mesh for any number of readers, each of which asks what has changed since it last did.
/// Thread-safe.
class MeshFeed {
 public:
  using BlockPtr = std::shared_ptr<const MeshBlock>;
  struct Changes {
    std::uint64_t version = 0, newest = 0;  ///< to ask with the next time; of all there is
    bool cleared = false;                   ///< forget every block first
    std::vector<BlockPtr> blocks;
  };

  /// `cleared`: forget every block first. Blocks replace those with the same key.
  void add(bool cleared, std::vector<MeshBlock> blocks);
  /// In place of all that grew.
  void set_whole(const Mesh& mesh);

  /// Since `version` (0: all there is), as many blocks as have about `most_vertices`; the rest the next time.
  Changes since(std::uint64_t version, std::size_t most_vertices) const;
  /// All blocks as one mesh; neighbors do not share vertices.
  Mesh whole() const;

 private:
  void put(BlockPtr block);

  mutable std::mutex mutex_;
  std::map<std::uint64_t, BlockPtr> by_version_;
  std::map<std::int64_t, std::uint64_t> version_of_;  // by the block's key
  std::uint64_t version_ = 0, cleared_at_ = 0;
};

}  // namespace gelslam
