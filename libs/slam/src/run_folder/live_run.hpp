#pragma once

#include <filesystem>
#include <memory>

#include "gelslam/slam/continue_scan.hpp"
#include "run_folder/run_writer.hpp"

namespace gelslam::slam::detail {

/// The run folder of a scan that is still going on: it is there from the start, for the growing log, and its
/// files are replaced whole at its end.
class LiveRun {
 public:
  /// Throws Error like check_run_folder(). `input` is never replaced; empty: a camera.
  static void check(const std::filesystem::path& folder, bool overwrite, const std::filesystem::path& input);

  /// Makes the folder with what is known at the start, its session included. Its report says that nothing was
  /// saved yet. `records`: a log is to grow in it. Throws Error like RunFolder.
  static std::shared_ptr<LiveRun> begin(const std::filesystem::path& folder, bool overwrite,
                                        const std::filesystem::path& input, bool records,
                                        const Config& config);
  /// The folder of a scan that is continued. Throws Error when the folder cannot be written.
  static std::shared_ptr<LiveRun> resume(const std::filesystem::path& folder, const ContinuedScan& scan,
                                         const std::filesystem::path& input, bool records,
                                         const Config& config);

  const std::filesystem::path& folder() const { return folder_; }
  /// log.mkv; of a part that continues a scan log-2.mkv, log-3.mkv, ...
  const std::filesystem::path& log() const { return log_; }
  /// What is scanned now.
  const ScanPart& part() const { return part_; }

  /// Throws Error when the disk is full or the folder may not be written; what was saved before is then still
  /// there. Also when another folder has its name now: then the map is saved beside that one, whole.
  /// `session_is_whole`: the session holds what was measured, else it is written.
  void save(const Run& run, bool session_is_whole);

 private:
  LiveRun(std::filesystem::path folder, std::filesystem::path log, ScanPart part,
          std::shared_ptr<const FolderLock> lock);

  const std::filesystem::path folder_, log_;
  const ScanPart part_;
  std::shared_ptr<const FolderLock> lock_;
};

}  // namespace gelslam::slam::detail
