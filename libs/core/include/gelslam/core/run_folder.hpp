#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gelslam/core/files.hpp"

namespace gelslam {

struct RunFolderOptions {
  bool overwrite = false;  ///< replace a folder that is there, with all it holds
  /// Only a folder that holds this file is ever replaced: it was written by us, and is not somebody's home.
  std::string marker_file = "report.json";
  /// All that such a folder may hold ("picture_*" stands for every name that begins so). With anything else
  /// in it, it is not replaced: a person has put that there. Empty: not checked.
  std::vector<std::string> known_entries = {};
  /// Files and folders that must not be, or lie inside, the folder that is replaced; empty names are ignored.
  std::vector<std::filesystem::path> inputs = {};
};

/// Throws Error when the folder exists, is not empty and may not be replaced. Makes nothing.
void check_run_folder(const std::filesystem::path& folder, const RunFolderOptions& options);

/// An output folder that appears whole or not at all: everything is written to path() (RUN.tmp-<pid> beside
/// RUN, locked), and commit() renames it to RUN. Destroyed without commit() it leaves nothing behind. After
/// kill -9 the temporary folder stays until the next run to RUN removes it. A run stopped by Ctrl-C commits
/// what it has, marked partial in report.json.
class RunFolder {
 public:
  /// Fails at once, before any work: throws Error when the folder exists, is not empty and may not be
  /// replaced, or when it cannot be created there. Missing parents are created.
  RunFolder(const std::filesystem::path& folder, const RunFolderOptions& options);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  const std::filesystem::path& path() const { return temporary_; }  ///< where to write, until commit()
  const std::filesystem::path& final_path() const { return final_; }
  /// Throws Error when something that may not be replaced has appeared meanwhile (another run into the same
  /// folder) or the disk refuses; what was written is then kept in RUN.kept-<pid>, which the error names.
  void commit();

 private:
  void put_in_place();

  std::filesystem::path final_, temporary_, first_created_parent_;
  RunFolderOptions options_;
  FolderLock lock_;  ///< of the temporary folder: tells other runs that this one is alive
};

}  // namespace gelslam
