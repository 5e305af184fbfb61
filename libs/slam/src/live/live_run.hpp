#pragma once

#include <filesystem>

#include "run_folder/run_writer.hpp"

namespace gelslam::slam::detail {

/// "RUN-2", "RUN-3", ...: the first that is not there.
std::filesystem::path next_run_folder(const std::filesystem::path& folder);

/// The run folder of a scan that is still going on: it is there from the start, for the growing log, and its
/// files are replaced whole whenever the scan is saved.
class LiveRun {
 public:
  /// Throws Error like check_run_folder(). `input` is never replaced; empty: a camera.
  static void check(const std::filesystem::path& folder, bool overwrite, const std::filesystem::path& input);

  /// Throws Error like RunFolder.
  LiveRun(const std::filesystem::path& folder, bool overwrite, const std::filesystem::path& input,
          const Config& config);

  const std::filesystem::path& folder() const { return folder_; }
  std::filesystem::path log() const { return folder_ / "log.mkv"; }

  /// Throws Error when the disk is full or the folder may not be written; what was saved before is then still
  /// there.
  void save(const SlamMap& map, const Mesh& mesh, const RunAccount& account);

 private:
  void replace_entries(const SlamMap& map, const Mesh& mesh, const RunAccount& account);

  const std::filesystem::path folder_;
  const Config config_;
};

}  // namespace gelslam::slam::detail
