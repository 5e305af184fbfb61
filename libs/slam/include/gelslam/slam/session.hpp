#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "gelslam/fusion/fusion.hpp"
#include "gelslam/slam/map_snapshot.hpp"
#include "gelslam/slam/slam_map.hpp"

namespace gelslam {

/// What is needed to fuse a map again, to relocalize in it or to draw it.
struct Session {
  double gradient_scale = 1.0;           ///< that is still in the surfaces
  std::vector<PosedSurface> patches;     ///< keyframes of the map, in the anchor's frame, by id
  std::vector<MapSnapshot::Edge> edges;  ///< of all keyframes, also outside the map
  bool is_current = true;             ///< false: the scan went on after this map was saved, or is another one
  std::vector<std::string> warnings;  ///< what could not be read, or is not in it, as sentences for the user
};

/// Writes a session: write_scan() and save_map(). Throws Error when the disk is full.
void save_session(const std::filesystem::path& folder, const SlamMap& map);

/// Writes what was concluded from the first `scan_bytes` of a record (scan.jsonl): session.json, replaced
/// whole.
void save_map(const std::filesystem::path& folder, const SlamMap& map, const std::filesystem::path& scan,
              std::uintmax_t scan_bytes);

/// Reads the map's patches, of this version or an older one. Keyframes whose surface is missing or damaged
/// are left out with a warning. Throws Error when there is no map, session.json is damaged, or a newer
/// version of the program has written it. Surfaces are unpacked when they are used.
Session load_session(const std::filesystem::path& folder);

/// One surface of a session. Throws Error.
PackedSurface read_packed_surface(const std::filesystem::path& file);

}  // namespace gelslam
