#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gelslam/core/files.hpp"
#include "gelslam/core/run_report.hpp"
#include "gelslam/core/trajectory.hpp"

namespace gelslam {

/// Return path patterns of files in a run folder, in which `*` stands for any characters except a slash: of
/// the files that a save writes, and of all files that the program ever writes there, except recordings.
std::vector<std::string> saved_entries();
std::vector<std::string> run_entries();
bool is_one_of(const std::filesystem::path& path, const std::vector<std::string>& patterns);

struct RunFolderOptions {
  /// Replace an existing folder with everything in it, except one that contains a recording (.mkv) at any
  /// depth.
  bool overwrite = false;
  /// A folder is replaced only if it contains this file, which shows that the program has written it.
  std::string marker_file = "report.json";
  std::string marker_text = {};  ///< Text that the marker file contains if the program has written it.
  /// Path patterns of all files that such a folder may contain. If it contains any other file, a user has put
  /// it there, and the folder is not replaced.
  std::vector<std::string> known_entries = run_entries();
  /// Files and folders that must not be identical to, or inside, the folder that is replaced; empty names are
  /// ignored.
  std::vector<std::filesystem::path> inputs = {};
};

/// Throws Error when the folder exists, is not empty and may not be replaced, or when another program writes
/// to it. Creates nothing.
void check_run_folder(const std::filesystem::path& folder, const RunFolderOptions& options);

/// Returns "RUN.gelslam-tmp was left by a command that did not end: ...", or "" if there is no such folder.
std::string left_behind(const std::filesystem::path& folder);

/// An output folder that becomes visible only when it is complete. Everything is written to path()
/// (RUN.gelslam-tmp beside RUN), and commit() moves it to RUN. Both folders are locked meanwhile, so that no
/// other program writes to RUN. If it is destroyed without commit(), only new parent folders of RUN remain.
/// After kill -9 the temporary folder remains until the next run to RUN removes it.
class RunFolder {
 public:
  /// Fails at once, before any work: throws Error when the folder exists, is not empty and may not be
  /// replaced, another program writes to it, or it cannot be created there. Missing parents are created.
  RunFolder(const std::filesystem::path& folder, const RunFolderOptions& options);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  const std::filesystem::path& path() const { return temporary_; }  ///< Where to write until commit().
  const std::filesystem::path& final_path() const { return final_; }
  bool replaces() const;  ///< True if RUN exists and is not empty.
  /// Exchanges RUN and the new folder in one step, so that a complete one exists at any time. Throws Error
  /// when something that may not be replaced has appeared in the meantime (another run into the same folder)
  /// or when the exchange fails; the new files then remain in RUN.gelslam-tmp, which the error names. Returns
  /// the lock of RUN, for callers that continue to write there.
  FolderLock commit();

 private:
  void lock_temporary();
  void lock_final();
  void put_in_place();

  std::filesystem::path final_, temporary_;
  RunFolderOptions options_;
  FolderLock lock_, final_lock_;  ///< Locks of the temporary folder and of the folder that is replaced.
};

/// Throws Error for a run without a map, saying which program is still writing it, or that its scan was not
/// finished.
[[noreturn]] void refuse_unfinished(const std::filesystem::path& folder);

/// Folder within a run folder in which a save is prepared. check_save() throws Error when it contains
/// anything that no save has put there.
inline constexpr const char* kSaving = "saving.tmp";
void check_save(const std::filesystem::path& folder);

/// Says, according to the report, whether nothing was saved yet, or a save was killed while it moved its
/// files into place.
bool is_unfinished(const std::filesystem::path& folder);

enum class RunNeeds { map, record };  ///< record: the measurements suffice, without a map.

/// Throws Error when a run folder contains a link, pipe or device in place of a file of a run, as its origin
/// may not be trusted.
void check_run_files(const std::filesystem::path& folder);

/// To be called before a run is read: calls check_run_files(), and throws Error that says what is missing and
/// what to do if the run is not complete. With RunNeeds::map the files of its last save must exist, too.
void check_is_run(const std::filesystem::path& folder, RunNeeds needs = RunNeeds::map);

/// The files of a run folder except mesh and session. Fields of missing files are empty.
struct RunFiles {
  std::filesystem::path folder;
  std::optional<RunReport> report;
  std::vector<StampedPose> trajectory, keyframes;

  /// Start of the first log in the trajectories: Unix time if known, else 0.
  double start_s() const { return report ? stamp_s(report->start_unix_us.value_or(0), 0) : 0; }
  /// Returns mesh.ply, or "" if it does not exist or is known to have no triangles.
  std::filesystem::path mesh_file() const;
};
/// Calls check_is_run() and reads the files. Throws Error for damaged files.
RunFiles read_run_files(const std::filesystem::path& folder);

}  // namespace gelslam
