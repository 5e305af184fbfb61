#pragma once

#include <filesystem>
#include <memory>

namespace gelslam {

/// Keeps other programs that ask in the same way out of a folder, until it is destroyed or its program ends,
/// however that ends; leaves no file. Where a file system knows no locks it does nothing. Movable.
class FolderLock {
 public:
  FolderLock();  ///< of nothing
  /// Throws Error when somebody else has the folder, or when it cannot be opened.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(FolderLock&&) noexcept;
  FolderLock& operator=(FolderLock&&) noexcept;

  bool holds() const { return directory_ != nullptr; }  ///< a folder was given

 private:
  struct Directory;
  std::unique_ptr<Directory> directory_;
};

}  // namespace gelslam
