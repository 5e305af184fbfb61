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

/// session.db of a run folder (docs/file-formats.md): what a scan has measured, and its map. It grows with
/// every keyframe. After kill -9 or a power loss everything is there that was written up to the last keyframe
/// or the last 25 frames. Not thread-safe; several may have one folder open. Its functions throw Error when
/// the disk is full or the folder may not be written; what was added is kept, and comes with the next that
/// can be written.
class Store {
 public:
  /// Goes on with the one that is there. Throws Error as read_scan().
  explicit Store(const std::filesystem::path& run);
  ~Store();

  void add(const ScanPart& part);
  void add(const FrameRecord& frame);  ///< is written with the next keyframe, or the next 25th frame
  void add(const NewKeyframe& added);
  /// The loops of a keyframe; to be called for every one that was searched, also if none were found.
  void add_loops(int keyframe, const std::vector<PoseGraphEdge>& loops);
  void flush();  ///< writes what waits; then all is on the disk

  void set_map(const SlamMap& map);  ///< replaces it

 private:
  using Work = std::function<void(SQLite::Database&)>;
  void write(Work work);

  std::unique_ptr<slam::detail::Database> database_;
  std::vector<Work> waiting_;  ///< to be written, all of it or nothing
  std::size_t refused_ = 0;    ///< how many of them the disk has refused
};

/// Makes the session of a new scan, to go on with.
void begin_store(const std::filesystem::path& run, const ScanPart& part);
/// Makes a whole session at once, of a map and what it was measured from.
void write_store(const std::filesystem::path& run, const SlamMap& map);
/// Copies the session of a run into another folder.
void copy_store(const std::filesystem::path& run, const std::filesystem::path& to);

/// Whether a folder holds a session, also one of an older version, which is not read.
bool has_session(const std::filesystem::path& folder);

/// What a scan has measured, also one that was killed. Throws Error when there is no session, it is damaged,
/// or of another version.
ScanRecord read_scan(const std::filesystem::path& run, const NormalFlowOptions& registration);

/// The map that was saved: its keyframes in the anchor's frame, and edges also of others. Nothing where the
/// scan was not finished. Throws Error as read_scan(). Surfaces are unpacked when they are used.
std::optional<MapSnapshot> find_saved_map(const std::filesystem::path& run);
/// The same; throws Error where the scan was not finished, or its last save is not complete.
MapSnapshot load_saved_map(const std::filesystem::path& run);

}  // namespace gelslam
