#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/core/stage_timer.hpp"
#include "gelslam/slam/reconstruct.hpp"

namespace gelslam {

/// Names of everything that the program puts into a run folder.
std::vector<std::string> run_entries();

/// How a live scan went, beside its map.
struct LiveAccount {
  double rate_hz = 0;
  std::int64_t arrived = 0, lost_by_camera = 0, dropped = 0, damaged = 0;
};

/// What report.json tells beside the map.
struct RunAccount {
  std::string program_version;
  std::filesystem::path log;  ///< empty: none was kept
  std::string log_description;
  std::vector<StageStatistics> times;
  ReconstructSummary summary;
  std::optional<LiveAccount> live;
};

/// Counts of the map and its mesh.
ReconstructSummary summarise(const SlamMap& map, const Mesh& mesh);

/// The map's mesh: all patches of the largest component, with the gradient scale taken out.
Mesh fuse_map(const SlamMap& map, const FusionOptions& options);

/// Writes every file of a run into the existing `folder` (docs/file-formats.md). Throws Error when the disk
/// is full.
void write_run(const std::filesystem::path& folder, const Config& config, const SlamMap& map,
               const Mesh& mesh, const RunAccount& account);

}  // namespace gelslam
