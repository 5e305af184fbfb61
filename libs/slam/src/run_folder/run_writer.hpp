#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "gelslam/core/run_folder.hpp"
#include "gelslam/slam/continue_scan.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "gelslam/slam/reconstruct.hpp"

namespace gelslam {

/// Writes every file of a run into the existing `folder` (docs/file-formats.md). Throws Error when a file
/// cannot be written.
void write_run(const std::filesystem::path& folder, const Run& run);
/// As write_run(), but without the session, which was written during the scan.
void write_results(const std::filesystem::path& folder, const Run& run);

/// Replaces files of a run, which must be locked, by those that `write` creates in a temporary folder:
/// results, and a new session if the old one could not be written to. Otherwise `map` is stored in the run's
/// session; null leaves the session's map as it is. Throws Error when a file cannot be written. If that or a
/// kill interrupts the replacement, is_unfinished() detects it.
void replace_results(const std::filesystem::path& run,
                     const std::function<void(const std::filesystem::path&)>& write, const SlamMap* map);

namespace slam::detail {

struct NewRun {
  std::filesystem::path folder;
  bool overwrite = false;
  std::filesystem::path input = {};  ///< Must not be overwritten; empty for a camera.
  bool records = false;              ///< The run folder contains a log that grows.
  /// The new session starts as a copy of this run's session. Must not be overwritten.
  std::filesystem::path continued_run = {};
};

/// The run folder of a scan in progress. It exists from the start for the files that grow (session, log); the
/// other files are replaced as a whole at the end. If a finished run is to be overwritten, the new folder
/// replaces it only when it is complete. An exception is a folder with a recorded log, which could not be
/// recorded again and is therefore in place from the start.
struct GrowingRun {
  std::filesystem::path folder;  ///< Current path of the folder.
  std::filesystem::path log;     ///< log.mkv, or log-2.mkv, log-3.mkv, ... for a part that continues a scan.
  ScanPart part;                 ///< The part that is being scanned.
  bool continues = false;        ///< True if the session does not contain `part` yet.
  std::shared_ptr<const FolderLock> lock;
  /// The new folder until put_in_place() replaces the old run with it; null if there is no old run.
  std::shared_ptr<RunFolder> replacement;

  /// Executes queued operations on the session until the queue is closed. Operations that the disk refuses
  /// are tried again with the next ones. Problems are passed to `say`. Returns why the session is incomplete,
  /// or "".
  std::string write_session(SessionQueue& measured, const std::function<void(const std::string&)>& say) const;

  /// Saves the results. Throws Error when the disk is full, when the folder cannot be written or was moved,
  /// or when a partial scan would replace a finished run; the earlier results are then kept.
  /// `session_problem` says why the session is incomplete, so that it is written completely; or "".
  void save(const Run& run, const std::string& session_problem) const;
  void put_in_place();  ///< To be called after save(). Throws Error as RunFolder::commit().
};

/// Throws Error if begin_run() would. Creates nothing.
void check_run(const NewRun& wanted);
/// Creates the run folder with the files that are known at the start, including the session. Its report says
/// that nothing was saved yet. `first_frame` is the number of the part's first frame. Throws Error as
/// RunFolder.
GrowingRun begin_run(const NewRun& wanted, const Config& config, std::int64_t first_frame = 0);
/// Opens the run folder of a scan to continue it. Throws Error when the folder cannot be written.
GrowingRun resume_run(const std::filesystem::path& folder, const ContinuedScan& scan,
                      const std::filesystem::path& input, bool records, const Config& config);

}  // namespace slam::detail
}  // namespace gelslam
