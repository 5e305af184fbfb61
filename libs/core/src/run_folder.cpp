#include "gelslam/core/run_folder.hpp"

#include <signal.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>

#include "gelslam/core/error.hpp"
#include "gelslam/core/file_descriptor.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

fs::path absolute_folder(const fs::path& folder) {
  if (folder.empty()) throw Error("the output folder's name is empty");
  std::error_code code;
  fs::path path = fs::weakly_canonical(fs::absolute(folder), code);
  if (code) throw Error(folder.string() + ": cannot be reached: " + code.message());
  if (!path.has_filename()) path = path.parent_path();  // "RUN/"
  if (!path.has_filename()) throw Error(folder.string() + ": cannot be an output folder; name a new one");
  return path;
}

bool lies_inside(const fs::path& path, const fs::path& folder) {
  std::error_code code;
  const fs::path relative = fs::weakly_canonical(fs::absolute(path), code).lexically_relative(folder);
  return !code && !relative.empty() && *relative.begin() != "..";
}

bool matches(const std::string& name, const std::string& known) {
  return known.ends_with('*') ? name.starts_with(known.substr(0, known.size() - 1)) : name == known;
}

/// Throws when the folder holds something that the command did not put there.
void check_entries(const fs::path& folder, const std::vector<std::string>& known) {
  std::error_code code;
  for (fs::directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code)) {
    const std::string name = entry->path().filename().string();
    if (std::none_of(known.begin(), known.end(), [&](const std::string& k) { return matches(name, k); }))
      throw Error(folder.string() + ": will not be overwritten, for it holds " + name +
                  ", which is not of this command");
  }
  if (code) throw Error(folder.string() + ": cannot be listed: " + code.message());
}

void check_may_write(const fs::path& folder, const RunFolderOptions& options) {
  std::error_code code;
  const fs::file_status status = fs::status(folder, code);
  if (!fs::exists(status)) return;
  if (!fs::is_directory(status)) throw Error(folder.string() + ": is a file; name a folder for the output");
  const bool empty = fs::is_empty(folder, code);
  if (code) throw Error(folder.string() + ": cannot be listed: " + code.message());
  if (empty) return;
  if (!options.overwrite)
    throw Error(folder.string() + ": exists already; name another folder or add --overwrite");
  if (!fs::exists(folder / options.marker_file, code)) {
    throw Error(folder.string() + ": will not be overwritten, for it holds no " + options.marker_file +
                " and so was not made by this command");
  }
  if (!options.known_entries.empty()) check_entries(folder, options.known_entries);
  for (const fs::path& input : options.inputs)
    if (!input.empty() && lies_inside(input, folder))
      throw Error(folder.string() + ": will not be overwritten, for it holds the input " + input.string());
}

/// The topmost folder on the way to `parent` that does not exist yet; empty when all do.
fs::path first_missing(fs::path parent) {
  std::error_code code;
  fs::path missing;
  while (!fs::exists(parent, code) && parent.has_relative_path()) {
    missing = parent;
    parent = parent.parent_path();
  }
  return missing;
}

fs::path sibling(const fs::path& folder, const std::string& kind) {
  return folder.parent_path() / (folder.filename().string() + "." + kind + "-" + std::to_string(::getpid()));
}

/// Whether every process that may be at work in the folder is seen from here. Not on a file system that other
/// hosts may share (numbers of linux/magic.h; FUSE may be sshfs).
bool is_on_this_host(const fs::path& folder) {
  static constexpr std::array<unsigned, 8> kShared = {
      0x6969 /* NFS */,      0x65735546 /* FUSE */, 0x01021997 /* 9p */,   0x517B /* SMB */,
      0xFE534D42 /* SMB2 */, 0xFF534D42 /* CIFS */, 0x00C36400 /* Ceph */, 0x5346414F /* AFS */};
  struct statfs system {};
  if (::statfs(folder.c_str(), &system) != 0) return false;
  return std::find(kShared.begin(), kShared.end(), static_cast<unsigned>(system.f_type)) == kShared.end();
}

/// The process that made the folder is gone: nobody holds its lock, and no process has its number (the lock
/// alone would do for our own folders; those of earlier releases have none).
bool is_left_behind(const fs::path& folder, const std::string& pid_text) {
  int pid = 0;
  const char* end = pid_text.data() + pid_text.size();
  const auto [rest, code] = std::from_chars(pid_text.data(), end, pid);
  if (code != std::errc() || rest != end || pid <= 0) return false;
  const bool other_process_lives = pid != ::getpid() && (::kill(pid, 0) == 0 || errno != ESRCH);
  return !other_process_lives && is_on_this_host(folder) &&
         FolderLock::state(folder) == FolderLock::State::free;
}

/// Removes the temporary folders of killed runs to `folder`: RUN.tmp-<pid>.
void remove_left_behind(const fs::path& folder) {
  const std::string beginning = folder.filename().string() + ".tmp-";
  std::error_code code;
  std::vector<fs::path> left;
  for (fs::directory_iterator entry(folder.parent_path(), code), end; !code && entry != end;
       entry.increment(code)) {
    const std::string name = entry->path().filename().string();
    std::error_code ignored;
    if (name.starts_with(beginning) && fs::is_directory(entry->symlink_status(ignored)) &&
        is_left_behind(entry->path(), name.substr(beginning.size())))
      left.push_back(entry->path());
  }
  for (const fs::path& one : left) fs::remove_all(one, code);
}

void rename_or_throw(const fs::path& from, const fs::path& to) {
  if (std::rename(from.c_str(), to.c_str()) != 0) {
    throw Error(to.string() + ": cannot be written: " + errno_text());
  }
}

}  // namespace

void check_run_folder(const fs::path& folder, const RunFolderOptions& options) {
  check_may_write(absolute_folder(folder), options);
}

RunFolder::RunFolder(const fs::path& folder, const RunFolderOptions& options)
    : final_(absolute_folder(folder)), temporary_(sibling(final_, "tmp")), options_(options) {
  check_may_write(final_, options_);
  std::error_code code;
  const fs::path missing = first_missing(final_.parent_path());
  fs::create_directories(final_.parent_path(), code);
  if (code) throw Error(folder.string() + ": cannot be created: " + code.message());
  first_created_parent_ = missing;
  remove_left_behind(final_);
  if (!fs::create_directory(temporary_, code)) {
    throw Error(folder.string() +
                ": cannot be created: " + (code ? code.message() : temporary_.string() + " exists"));
  }
  lock_ = FolderLock(temporary_);
}

RunFolder::~RunFolder() {
  if (temporary_.empty()) return;
  std::error_code ignored;
  fs::remove_all(temporary_, ignored);
  if (first_created_parent_.empty()) return;
  for (fs::path parent = final_.parent_path();; parent = parent.parent_path()) {
    if (!fs::remove(parent, ignored) || parent == first_created_parent_)
      return;  // stops at one that others use
  }
}

void RunFolder::commit() {
  try {
    put_in_place();
  } catch (const Error& error) {
    if (temporary_.empty()) throw;
    fs::path kept = sibling(final_, "kept");  // no longer a name that the next run removes
    if (std::rename(temporary_.c_str(), kept.c_str()) != 0) kept = temporary_;
    temporary_.clear();
    throw Error(std::string(error.what()) + "; what was to be there is in " + kept.string());
  }
}

void RunFolder::put_in_place() {
  check_may_write(final_, options_);
  std::error_code code;
  const bool replaces = fs::exists(final_, code) && !fs::is_empty(final_, code);
  const fs::path old = sibling(final_, "old");
  if (replaces) rename_or_throw(final_, old);
  try {
    rename_or_throw(temporary_, final_);
  } catch (const Error&) {
    if (replaces) rename_or_throw(old, final_);
    throw;
  }
  temporary_.clear();
  lock_ = FolderLock();
  if (replaces) fs::remove_all(old, code);
  sync_folder(final_.parent_path());
}

}  // namespace gelslam
