#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "gelslam/core/file_descriptor.hpp"

namespace gelslam {

/// A file under construction: write to path(), then commit() makes it appear whole under its final name
/// (fsync, rename). Without commit() it vanishes; what a killed program left, with the next file of that
/// name. The temporary name lies in the same folder and keeps the ending, so that writers which choose the
/// format by it (cv::VideoWriter, cv::imwrite) work. A final name that is a symbolic link is followed.
class TemporaryFile {
 public:
  /// Throws Error when the folder does not exist or cannot be written, or when a folder has the final name.
  explicit TemporaryFile(const std::filesystem::path& final_path);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  const std::filesystem::path& path() const { return temporary_path_; }
  /// Throws Error when the file is not there or the disk does not take it.
  void commit();

 private:
  std::filesystem::path final_path_, temporary_path_;
  FileDescriptor lock_;  ///< says that this program is alive
};

/// Writes a whole file at once; until it is complete the old one (or none) stays. A device or pipe
/// (/dev/stdout) is written directly. Throws Error, naming the path, on a full disk or missing permission.
void write_file_atomically(const std::filesystem::path& path, std::string_view contents);

/// All bytes of a file. Throws Error that names it and says why it cannot be read; files of more than 1 GiB,
/// which the program never writes, are refused.
std::string read_file(const std::filesystem::path& path);

/// Throws Error, with what to do, where Git LFS has left a note in place of the file's contents.
void refuse_lfs_pointer(const std::filesystem::path& path);

/// The name of a folder or file; of "data/pebble/" it is "pebble".
std::string name_of(const std::filesystem::path& path);

/// Keeps other programs that use the same class out of a folder, until it is destroyed or its program ends,
/// even by kill -9; leaves no file. Does nothing on a file system without locks. Movable.
class FolderLock {
 public:
  FolderLock() = default;  ///< locks nothing
  /// Throws Error when another program holds the lock (naming that program and its process number, where the
  /// system tells), or when the folder cannot be opened. `shown`: the folder's name in the message; empty:
  /// its path.
  explicit FolderLock(const std::filesystem::path& folder, const std::filesystem::path& shown = {});

  /// Whether this is the folder that is locked: it may have been moved away, and another one put there.
  bool is_of(const std::filesystem::path& folder) const;
  bool holds() const { return directory_.ok(); }  ///< a folder was given
  /// Whether somebody (this process included) has the folder now, as far as the file system tells.
  static bool is_taken(const std::filesystem::path& folder);

 private:
  FileDescriptor directory_;
};

}  // namespace gelslam
