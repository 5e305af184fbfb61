#pragma once

#include <filesystem>

namespace gelslam {

/// Replaces several files of a folder as a whole. They are written to path() (FOLDER/saving.tmp); commit()
/// renames that to FOLDER/saved.tmp, which makes them part of the folder, and moves them to their places.
/// What a killed program leaves there is moved by the next program that writes to the folder; those that read
/// refuse it until then (check_run_files()). Without commit() it vanishes.
class FolderUpdate {
 public:
  /// `folder` exists and is locked by the caller. Throws Error when it cannot be written.
  explicit FolderUpdate(const std::filesystem::path& folder);
  ~FolderUpdate();
  FolderUpdate(const FolderUpdate&) = delete;
  FolderUpdate& operator=(const FolderUpdate&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Throws Error when the disk refuses. What is in a subfolder goes to the same subfolder of FOLDER.
  void commit();

 private:
  std::filesystem::path folder_, path_;
};

/// Completes a commit() that was interrupted, unless another program writes to the folder: for those who are
/// going to write there, too. Moves only files that a save writes, and none through a link. Throws Error when
/// the folder cannot be written, or saved.tmp holds anything else.
void finish_update(const std::filesystem::path& folder);

}  // namespace gelslam
