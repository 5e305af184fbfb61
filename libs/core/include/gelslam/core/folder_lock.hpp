#pragma once

#include <filesystem>
#include <memory>

namespace gelslam {

/// Keeps other programs that use the same class out of a folder, until it is destroyed or its program ends,
/// even by kill -9; leaves no file. Does nothing on a file system without locks. Movable.
class FolderLock {
 public:
  enum class State { free, taken, unknown };  ///< unknown: cannot be opened, or a file system without locks

  FolderLock();  ///< of nothing
  /// Throws Error when somebody else has the folder, or when it cannot be opened.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(FolderLock&&) noexcept;
  FolderLock& operator=(FolderLock&&) noexcept;

  bool holds() const { return directory_ != nullptr; }  ///< a folder was given
  /// Whether somebody (this process included) has the folder now.
  static State state(const std::filesystem::path& folder);

 private:
  struct Directory;
  std::unique_ptr<Directory> directory_;
};

}  // namespace gelslam
