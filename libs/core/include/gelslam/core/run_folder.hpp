#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gelslam/core/files.hpp"
#include "gelslam/core/run_report.hpp"
#include "gelslam/core/trajectory.hpp"

namespace gelslam {

/// Paths in a run folder, `*` standing for any characters but a slash: of what a save writes, and of all that
/// the program ever puts there but its recordings.
std::vector<std::string> saved_entries();
std::vector<std::string> run_entries();
bool is_one_of(const std::filesystem::path& path, const std::vector<std::string>& patterns);

struct RunFolderOptions {
  /// Replace a folder that is there, with all it holds; but never one that holds a recording (.mkv), at
  /// whatever depth.
  bool overwrite = false;
  /// Only a folder that holds this file is ever replaced: the program has written it.
  std::string marker_file = "report.json";
  std::string marker_text = {};  ///< that the file holds when the program has written it
  /// Paths of all files that such a folder may hold, as patterns. With anything else in it, it is not
  /// replaced: a person has put that there.
  std::vector<std::string> known_entries = run_entries();
  /// Files and folders that must not be, or lie inside, the folder that is replaced; empty names are ignored.
  std::vector<std::filesystem::path> inputs = {};
};

/// Throws Error when the folder exists, is not empty and may not be replaced, or when another program writes
/// to it. Makes nothing.
void check_run_folder(const std::filesystem::path& folder, const RunFolderOptions& options);

/// "RUN.gelslam-tmp was left by a command that did not end: ..."; "" where there is none.
std::string left_behind(const std::filesystem::path& folder);

/// An output folder that appears whole or not at all: everything is written to path() (RUN.gelslam-tmp beside
/// RUN), and commit() puts it in the place of RUN. Both folders are locked meanwhile: nobody else writes to
/// RUN. Destroyed without commit() it leaves nothing behind but parents of RUN. After kill -9 the temporary
/// folder stays until the next run to RUN removes it.
class RunFolder {
 public:
  /// Fails at once, before any work: throws Error when the folder exists, is not empty and may not be
  /// replaced, another program writes to it, or it cannot be created there. Missing parents are created.
  RunFolder(const std::filesystem::path& folder, const RunFolderOptions& options);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  const std::filesystem::path& path() const { return temporary_; }  ///< where to write, until commit()
  const std::filesystem::path& final_path() const { return final_; }
  bool replaces() const;  ///< RUN is there, and not empty
  /// RUN and what it replaces change places at once, so that at any time one of them is there, whole. Throws
  /// Error when something that may not be replaced has appeared meanwhile (another run into the same folder)
  /// or the disk refuses; what was written then stays in RUN.gelslam-tmp, which the error names. Returns the
  /// lock of RUN, for those who go on writing there.
  FolderLock commit();

 private:
  void lock_temporary();
  void lock_final();
  void put_in_place();

  std::filesystem::path final_, temporary_;
  RunFolderOptions options_;
  FolderLock lock_, final_lock_;  ///< of the temporary folder, and of the one that is replaced
};

/// Throws Error for a run without a map: who is still writing it, or that its scan was not finished.
[[noreturn]] void refuse_unfinished(const std::filesystem::path& folder);

/// In a run folder: where a save is made. Throws Error when it holds something that no save has put there.
inline constexpr const char* kSaving = "saving.tmp";
void check_save(const std::filesystem::path& folder);

/// By the report: nothing was saved yet, or a save was killed while its files came to their places.
bool is_unfinished(const std::filesystem::path& folder);

enum class RunNeeds { map, record };  ///< record: the measurements are enough

/// Throws Error where a run folder holds a link, pipe or device in the place of a file of a run: it may come
/// from anybody.
void check_run_files(const std::filesystem::path& folder);

/// To be called before a run is read: check_run_files(), then throws Error, saying what is missing and what
/// to do, where the run is not complete; `map`: with the files of its last save.
void check_is_run(const std::filesystem::path& folder, RunNeeds needs = RunNeeds::map);

/// What a run folder holds beside its mesh and session; what it lacks stays empty.
struct RunFiles {
  std::filesystem::path folder;
  std::optional<RunReport> report;
  std::vector<StampedPose> trajectory, keyframes;

  /// Of the first log, in the trajectories: Unix time, where that is known.
  double start_s() const { return report ? stamp_s(report->start_unix_us.value_or(0), 0) : 0; }
  /// mesh.ply; "" where there is none, or where it is known to have no triangles.
  std::filesystem::path mesh_file() const;
};
/// check_is_run(), and reads them. Throws Error for damaged files.
RunFiles read_run_files(const std::filesystem::path& folder);

}  // namespace gelslam
