#include "gelslam/core/folder_update.hpp"

#include <algorithm>
#include <cstdio>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/core/file_descriptor.hpp"
#include "gelslam/core/files.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

fs::path saved_in(const fs::path& folder) { return folder / "saved.tmp"; }

void move_file(const fs::path& from, const fs::path& to) {
  if (std::rename(from.c_str(), to.c_str()) != 0)
    throw Error(to.string() + ": cannot be written: " + errno_text());
}

/// Can be begun again after any of its steps.
void move_all(const fs::path& from, const fs::path& to) {
  std::error_code code;
  std::vector<fs::path> entries;
  for (fs::directory_iterator entry(from, code), end; !code && entry != end; entry.increment(code))
    entries.push_back(entry->path());
  std::sort(entries.begin(), entries.end());
  for (const fs::path& entry : entries) {
    const fs::path target = to / entry.filename();
    if (!fs::is_directory(entry, code)) {
      move_file(entry, target);
      continue;
    }
    fs::create_directory(target, code);
    move_all(entry, target);
  }
  sync_folder(to);
  fs::remove(from, code);
}

void finish_locked(const fs::path& folder) {
  std::error_code code;
  if (fs::is_directory(saved_in(folder), code)) move_all(saved_in(folder), folder);
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
  if (!fs::is_directory(saved_in(folder), code) || FolderLock::state(folder) == FolderLock::State::taken)
    return;
  const FolderLock lock(folder);
  finish_locked(folder);
}

}  // namespace gelslam
