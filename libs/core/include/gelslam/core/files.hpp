#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "gelslam/core/file_descriptor.hpp"

namespace gelslam {

/// A file that becomes visible only when it is complete. It is written to path(), and commit() moves it to
/// its final name (fsync, rename). Without commit() the temporary file is removed; one that a killed program
/// left is removed when the next file of that name is written. The temporary file is in the same folder and
/// has the same extension, so that writers which choose the format by it (cv::VideoWriter, cv::imwrite) work.
/// If the final name is a symbolic link, the link is followed.
class TemporaryFile {
 public:
  /// Throws Error when the folder does not exist or cannot be written, or when a folder has the final name.
  explicit TemporaryFile(const std::filesystem::path& final_path);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  const std::filesystem::path& path() const { return temporary_path_; }
  /// Throws Error when the file does not exist or the disk is full.
  void commit();

 private:
  std::filesystem::path final_path_, temporary_path_;
  FileDescriptor lock_;  ///< Tells other processes that this program is still running.
};

/// Writes a whole file; until it is complete, the old file (or none) remains. A device or pipe (/dev/stdout)
/// is written directly. Throws Error that names the path, for example on a full disk or without permission.
void write_file_atomically(const std::filesystem::path& path, std::string_view contents);

/// Returns all bytes of a file. Throws Error that names it and says why it cannot be read. Files of more than
/// 1 GiB are refused, as the program never writes such files.
std::string read_file(const std::filesystem::path& path);

/// Throws Error with advice if the file is a Git LFS pointer instead of the contents.
void refuse_lfs_pointer(const std::filesystem::path& path);

/// Returns the last component of a path; for "data/pebble/" it is "pebble".
std::string name_of(const std::filesystem::path& path);

/// Excludes other programs that use the same class from a folder until it is destroyed or the program ends,
/// even by kill -9. Leaves no file. Has no effect on a file system without locks. Movable.
class FolderLock {
 public:
  FolderLock() = default;  ///< locks nothing
  /// Throws Error when another program holds the lock (naming that program and its process number, where the
  /// system tells), or when the folder cannot be opened. `shown`: the folder's name in the message; empty:
  /// its path.
  explicit FolderLock(const std::filesystem::path& folder, const std::filesystem::path& shown = {});

  /// Says whether this is the locked folder. The locked folder may have been moved, and another one put in
  /// its place.
  bool is_of(const std::filesystem::path& folder) const;
  bool holds() const { return directory_.ok(); }  ///< True if a folder was given.
  /// Says whether any process, this one included, holds the lock of the folder, as far as the file system
  /// tells.
  static bool is_taken(const std::filesystem::path& folder);

 private:
  FileDescriptor directory_;
};

}  // namespace gelslam
