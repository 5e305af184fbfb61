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

/// Writes every file of a run into the existing `folder` (docs/file-formats.md). Throws Error when the disk
/// is full.
void write_run(const std::filesystem::path& folder, const Run& run);
/// The same without the session, which a scan has written while it went on.
void write_results(const std::filesystem::path& folder, const Run& run);

/// Replaces files of a run, which is locked, by those that `write` puts into a folder: results, and the
/// session where that could not be written to. Then the run's session has `map`; null: the one that it had.
/// Throws Error when the disk refuses. What that or a kill leaves half done is seen: is_unfinished().
void replace_results(const std::filesystem::path& run,
                     const std::function<void(const std::filesystem::path&)>& write, const SlamMap* map);

namespace slam::detail {

struct NewRun {
  std::filesystem::path folder;
  bool overwrite = false;
  std::filesystem::path input = {};          ///< never replaced; empty: a camera
  bool records = false;                      ///< a log is to grow in it
  std::filesystem::path continued_run = {};  ///< whose session it begins with; never replaced
};

/// The run folder of a scan that is still going on: it is there from the start, for what grows (session,
/// log), and its other files are replaced whole at its end. In the place of a finished run, which is
/// overwritten, it comes when it is whole; unless it holds a recording, which cannot be made again.
struct GrowingRun {
  std::filesystem::path folder;  ///< where it is now
  std::filesystem::path log;     ///< log.mkv; of a part that continues a scan log-2.mkv, log-3.mkv, ...
  ScanPart part;                 ///< what is scanned now
  bool continues = false;        ///< the session does not have `part` yet
  std::shared_ptr<const FolderLock> lock;
  std::shared_ptr<RunFolder> replacement;  ///< of the old run, until put_in_place(); null: there is none

  /// Writes what comes into the session until the queue is closed, as soon as the disk takes it. Gives `say`
  /// what is wrong with it. Returns why it is not whole; or "".
  std::string write_session(SessionQueue& measured, const std::function<void(const std::string&)>& say) const;

  /// Throws Error when the disk is full, the folder may not be written or was moved, or a part would replace
  /// a run; what was saved before is then still there. `session_problem`: why the session is not whole, so
  /// that it is written; or "".
  void save(const Run& run, const std::string& session_problem) const;
  void put_in_place();  ///< after save(). Throws Error as RunFolder::commit()
};

/// Throws Error where begin_run() would. Makes nothing.
void check_run(const NewRun& wanted);
/// Makes the folder with what is known at the start, its session included. Its report says that nothing was
/// saved yet. `first_frame`: of what is scanned now. Throws Error like RunFolder.
GrowingRun begin_run(const NewRun& wanted, const Config& config, std::int64_t first_frame = 0);
/// The folder of a scan that is continued. Throws Error when the folder cannot be written.
GrowingRun resume_run(const std::filesystem::path& folder, const ContinuedScan& scan,
                      const std::filesystem::path& input, bool records, const Config& config);

}  // namespace slam::detail
}  // namespace gelslam
