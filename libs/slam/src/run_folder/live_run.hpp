#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "gelslam/core/files.hpp"
#include "run_folder/run_writer.hpp"

namespace gelslam::slam::detail {

/// The run folder of a scan that is still going on: it is there from the start, for the growing log, and its
/// files are replaced whole whenever the scan is saved.
class LiveRun {
 public:
  /// Throws Error like check_run_folder(). `input` is never replaced; empty: a camera.
  static void check(const std::filesystem::path& folder, bool overwrite, const std::filesystem::path& input);

  /// Makes the folder with what is known at the start. Its report says that nothing was saved yet. Throws
  /// Error like RunFolder.
  static std::shared_ptr<LiveRun> begin(const std::filesystem::path& folder, bool overwrite,
                                        const std::filesystem::path& input, const Config& config);
  /// The folder of a scan that is continued. `lock`: taken before the scan was read. Throws Error when the
  /// folder cannot be written.
  static std::shared_ptr<LiveRun> resume(const std::filesystem::path& folder,
                                         std::shared_ptr<const FolderLock> lock);

  const std::filesystem::path& folder() const { return folder_; }
  std::filesystem::path session() const { return folder_ / "session"; }
  /// log.mkv; of a part that continues a scan log-2.mkv, log-3.mkv, ...
  const std::filesystem::path& log() const { return log_; }

  /// Size of the session's record. What it holds now will be in every map that is asked for from now on.
  std::uintmax_t record_bytes() const;

  /// Throws Error when the disk is full or the folder may not be written; what was saved before is then still
  /// there. Also when another folder has its name now: then the map is saved beside that one, whole.
  /// `scan_bytes`: record_bytes() when the map was requested; none: the record is missing or incomplete.
  void save(const Run& run, std::optional<std::uintmax_t> scan_bytes);

 private:
  LiveRun(std::filesystem::path folder, std::filesystem::path log, std::shared_ptr<const FolderLock> lock);
  void replace_entries(const Run& run, std::optional<std::uintmax_t> scan_bytes);

  const std::filesystem::path folder_, log_;
  std::shared_ptr<const FolderLock> lock_;
};

}  // namespace gelslam::slam::detail
