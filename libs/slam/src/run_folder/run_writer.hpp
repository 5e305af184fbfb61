#pragma once

#include <filesystem>

#include "gelslam/slam/reconstruct.hpp"

namespace gelslam {

/// Writes every file of a run into the existing `folder` (docs/file-formats.md). Throws Error when the disk
/// is full.
void write_run(const std::filesystem::path& folder, const Run& run);
/// The same without the session, which a live scan has written while it went on.
void write_results(const std::filesystem::path& folder, const Run& run);

}  // namespace gelslam
