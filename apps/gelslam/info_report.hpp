#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "gelslam/core/progress.hpp"

namespace gelslam {

/// What `gelslam info` says of a file or folder: what it is, whether it is whole, what can be done with it.
struct InfoReport {
  std::filesystem::path path;
  std::string kind;
  std::vector<std::pair<std::string, std::string>> facts = {};  ///< "log": "320x240, 25 Hz, 245 frames"
  std::vector<std::string> warnings = {};                       ///< what a run lacks
  std::vector<std::string> problems = {};                       ///< what keeps other commands from using it
  std::vector<std::string> commands = {};                       ///< "export", "track --map": what takes it
};

/// Throws Error when `path` is nothing of ours or, for a single file, damaged; a damaged part of a folder is
/// a problem in the report.
InfoReport inspect(const std::filesystem::path& path, int track, ProgressSink& progress);

}  // namespace gelslam
