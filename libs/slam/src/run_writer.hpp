#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gelslam/core/stage_timer.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "gelslam/slam/reconstruct.hpp"

namespace gelslam {

/// Names of everything that write_run() puts into a run folder.
std::vector<std::string> run_entries();

/// Writes every file of a run into the existing `folder` (docs/file-formats.md). Throws Error when the disk is full.
void write_run(const std::filesystem::path& folder, const ReconstructRequest& request, const std::string& log_description,
               const SlamMap& map, const Mesh& mesh, const std::vector<StageStatistics>& times,
               const ReconstructSummary& summary);

}  // namespace gelslam
