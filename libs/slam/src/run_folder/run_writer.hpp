#pragma once

#include <filesystem>
#include <functional>

#include "gelslam/slam/reconstruct.hpp"

namespace gelslam {

/// Writes every file of a run into the existing `folder` (docs/file-formats.md). Throws Error when the disk
/// is full.
void write_run(const std::filesystem::path& folder, const Run& run);
/// The same without the session, which a live scan has written while it went on.
void write_results(const std::filesystem::path& folder, const Run& run);

/// Replaces files of a run, which is locked, by those that `write` puts into a folder: results, and the
/// session where that could not be written to. Then the run's session has `map`; null: the one that it had.
/// Throws Error when the disk refuses. What that or a kill leaves half done is seen: has_incomplete_save().
void replace_results(const std::filesystem::path& run,
                     const std::function<void(const std::filesystem::path&)>& write, const SlamMap* map);

}  // namespace gelslam
