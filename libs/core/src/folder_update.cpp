#include "gelslam/core/folder_update.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/core/file_descriptor.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/run_folder.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

fs::path saved_in(const fs::path& folder) { return folder / "saved.tmp"; }

void move_file(const fs::path& from, const fs::path& to) {
  if (std::rename(from.c_str(), to.c_str()) != 0)
    throw Error(to.string() + ": cannot be written: " + errno_text());
}

/// Neither the folder nor the one that it lies in can be a link to somewhere else.
FileDescriptor open_in(const FileDescriptor& folder, const fs::path& name) {
  return FileDescriptor(::openat(folder.get(), name.empty() ? "." : name.c_str(),
                                 O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
}

/// By their paths in `saved`. Throws Error for what no save writes.
std::vector<fs::path> files_of_save(const fs::path& saved) {
  std::error_code code;
  std::vector<fs::path> files;
  for (fs::recursive_directory_iterator entry(saved, code), end; !code && entry != end;
       entry.increment(code)) {
    const fs::path name = entry->path().lexically_relative(saved);
    const fs::file_type type = entry->symlink_status(code).type();
    if (type == fs::file_type::directory && name == "session") continue;
    if (type != fs::file_type::regular || !is_one_of(name, saved_entries()))
      throw Error(entry->path().string() + ": was not put there by a save; remove it");
    files.push_back(name);
  }
  if (code) throw Error(saved.string() + ": cannot be read: " + code.message());
  std::sort(files.begin(), files.end());
  return files;
}

/// Can be begun again after any of its steps.
void finish_locked(const fs::path& folder) {
  std::error_code code;
  const fs::path saved = saved_in(folder);
  if (!fs::exists(fs::symlink_status(saved, code))) return;
  const std::vector<fs::path> files = files_of_save(saved);
  const FileDescriptor run(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)),
      from = open_in(run, saved.filename());
  for (const fs::path& file : files) {
    if (file.has_parent_path()) ::mkdirat(run.get(), file.parent_path().c_str(), 0777);
    const FileDescriptor source = open_in(from, file.parent_path()),
                         target = open_in(run, file.parent_path());
    const fs::path name = file.filename();
    if (::renameat(source.get(), name.c_str(), target.get(), name.c_str()) != 0)
      throw Error((folder / file).string() + ": cannot be written: " + errno_text());
  }
  sync_folder(folder / "session");
  sync_folder(folder);
  fs::remove_all(saved, code);
}

}  // namespace

FolderUpdate::FolderUpdate(const fs::path& folder) : folder_(folder), path_(folder / "saving.tmp") {
  finish_locked(folder_);
  std::error_code code;
  fs::remove_all(path_, code);
  if (!code) fs::create_directory(path_, code);
  if (code) throw Error(folder_.string() + ": cannot be written: " + code.message());
}

FolderUpdate::~FolderUpdate() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

void FolderUpdate::commit() {
  move_file(path_, saved_in(folder_));
  sync_folder(folder_);
  finish_locked(folder_);
}

void finish_update(const fs::path& folder) {
  std::error_code code;
  if (!fs::exists(fs::symlink_status(saved_in(folder), code)) ||
      FolderLock::state(folder) == FolderLock::State::taken)
    return;
  const FolderLock lock(folder);
  finish_locked(folder);
}

}  // namespace gelslam
