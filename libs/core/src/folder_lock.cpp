#include "gelslam/core/folder_lock.hpp"

#include <sys/file.h>

#include "gelslam/core/error.hpp"
#include "gelslam/core/file_descriptor.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam {

struct FolderLock::Directory {
  FileDescriptor descriptor;
};

FolderLock::FolderLock() = default;
FolderLock::~FolderLock() = default;
FolderLock::FolderLock(FolderLock&&) noexcept = default;
FolderLock& FolderLock::operator=(FolderLock&&) noexcept = default;

FolderLock::FolderLock(const std::filesystem::path& folder)
    : directory_(new Directory{FileDescriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC))}) {
  if (!directory_->descriptor.ok()) throw Error(quoted(folder) + " cannot be opened: " + errno_text());
  if (::flock(directory_->descriptor.get(), LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  throw Error("another program is writing to " + quoted(folder) + ": end it first, or name another folder");
}

FolderLock::State FolderLock::state(const std::filesystem::path& folder) {
  const FileDescriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!directory.ok()) return State::unknown;
  if (::flock(directory.get(), LOCK_EX | LOCK_NB) == 0) return State::free;
  return errno == EWOULDBLOCK ? State::taken : State::unknown;
}

}  // namespace gelslam
