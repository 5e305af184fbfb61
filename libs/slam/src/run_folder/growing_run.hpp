#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "gelslam/slam/continue_scan.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "run_folder/run_writer.hpp"

namespace gelslam::slam::detail {

struct NewRun {
  std::filesystem::path folder;
  bool overwrite = false;
  std::filesystem::path input = {};          ///< never replaced; empty: a camera
  bool records = false;                      ///< a log is to grow in it
  std::filesystem::path continued_run = {};  ///< whose session it begins with; never replaced
};

/// The run folder of a scan that is still going on: it is there from the start, for what grows (session,
/// log), and its other files are replaced whole at its end.
class GrowingRun {
 public:
  /// Throws Error where begin() would. Makes nothing.
  static void check(const NewRun& wanted);

  /// Makes the folder with what is known at the start, its session included. Its report says that nothing was
  /// saved yet. `first_frame`: of what is scanned now. Throws Error like RunFolder.
  static std::shared_ptr<GrowingRun> begin(const NewRun& wanted, const Config& config,
                                           std::int64_t first_frame = 0);
  /// The folder of a scan that is continued. Throws Error when the folder cannot be written.
  static std::shared_ptr<GrowingRun> resume(const std::filesystem::path& folder, const ContinuedScan& scan,
                                            const std::filesystem::path& input, bool records,
                                            const Config& config);

  const std::filesystem::path& folder() const { return folder_; }
  /// log.mkv; of a part that continues a scan log-2.mkv, log-3.mkv, ...
  const std::filesystem::path& log() const { return log_; }
  /// What is scanned now.
  const ScanPart& part() const { return part_; }

  /// Writes what comes into the session until the queue is closed. Returns why it could not, then closes it;
  /// or "".
  std::string write_session(SessionQueue& measured) const;

  /// Throws Error when the disk is full, or the folder may not be written or was moved; what was saved before
  /// is then still there. `session_is_whole`: the session holds what was measured, else it is written.
  void save(const Run& run, bool session_is_whole) const;

 private:
  GrowingRun(std::filesystem::path folder, std::filesystem::path log, ScanPart part, bool continues,
             std::shared_ptr<const FolderLock> lock);

  const std::filesystem::path folder_, log_;
  const ScanPart part_;
  const bool continues_;  // the session does not have part_ yet
  const std::shared_ptr<const FolderLock> lock_;
};

}  // namespace gelslam::slam::detail
