#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "gelslam/fusion/fusion.hpp"
#include "gelslam/slam/map_snapshot.hpp"
#include "gelslam/slam/slam_map.hpp"

namespace SQLite {  // NOLINT: not ours
class Database;
}

namespace gelslam {

namespace slam::detail {
class Database;
}

/// session.db of a run folder (docs/file-formats.md): the measurements of a scan, and its map. It grows with
/// every keyframe. After kill -9 or a power loss it contains everything up to the last keyframe or the last
/// multiple of 25 frames. Not thread-safe; several processes may have one folder open. The functions throw
/// Error when the disk is full or the folder may not be written. What was added then stays in memory and is
/// written by the next call that succeeds.
class Store {
 public:
  /// Opens an existing session to continue it. Throws Error as read_scan().
  explicit Store(const std::filesystem::path& run);
  ~Store();

  void add(const ScanPart& part);
  /// The frame is written together with the next keyframe, or with every 25th frame.
  void add(const FrameRecord& frame);
  void add(const NewKeyframe& added);
  /// Adds the loops of a keyframe. Must be called for every keyframe that was searched, even if none were
  /// found.
  void add_loops(int keyframe, const std::vector<PoseGraphEdge>& loops);
  void flush();  ///< Writes everything that is pending to the disk.

  void set_map(const SlamMap& map);  ///< Replaces the stored map.

 private:
  using Work = std::function<void(SQLite::Database&)>;
  void write(Work work);

  std::unique_ptr<slam::detail::Database> database_;
  std::vector<Work> waiting_;  ///< Operations to be written in one transaction.
  std::size_t refused_ = 0;    ///< Number of pending operations that the disk has already refused.
};

/// Creates the session of a new scan.
void begin_store(const std::filesystem::path& run, const ScanPart& part);
/// Writes a complete session for a finished map and its measurements.
void write_store(const std::filesystem::path& run, const SlamMap& map);
/// Copies the session of a run into another folder.
void copy_store(const std::filesystem::path& run, const std::filesystem::path& to);

/// Says whether a folder contains a session, including one of an older version that cannot be read.
bool has_session(const std::filesystem::path& folder);

/// Reads the measurements of a scan, including one that was killed. Throws Error when there is no session, or
/// when it is damaged or of another version.
ScanRecord read_scan(const std::filesystem::path& run, const NormalFlowOptions& registration);

/// Reads the saved map. Its keyframes are in the anchor's frame; edges of other components are included.
/// Returns nothing if the scan was not finished. Throws Error as read_scan(). Surfaces are decompressed when
/// they are used.
std::optional<MapSnapshot> find_saved_map(const std::filesystem::path& run);
/// As find_saved_map(), but throws Error if the scan was not finished or its last save is incomplete.
MapSnapshot load_saved_map(const std::filesystem::path& run);

}  // namespace gelslam
