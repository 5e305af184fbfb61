#include "gelslam/core/run_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fnmatch.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
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
  if (!path.has_filename()) path = path.parent_path();  // The path ends in a slash: "RUN/".
  if (!path.has_filename()) throw Error(folder.string() + ": cannot be an output folder; name a new one");
  return path;
}

bool lies_inside(const fs::path& path, const fs::path& folder) {
  std::error_code code;
  const fs::path relative = fs::weakly_canonical(fs::absolute(path), code).lexically_relative(folder);
  return !code && !relative.empty() && *relative.begin() != "..";
}

/// Throws when the folder contains a recording, or anything that the program did not put there.
void check_entries(const fs::path& folder, const std::vector<std::string>& known) {
  std::error_code code;
  for (fs::recursive_directory_iterator entry(folder, code), end; !code && entry != end;
       entry.increment(code)) {
    const fs::path name = entry->path().lexically_relative(folder);
    if (name.extension() == ".mkv")
      throw Error(folder.string() + ": will not be overwritten, for it holds the recording " + name.string() +
                  ", which cannot be made again; move that out of it, or name another folder");
    if (entry->symlink_status(code).type() != fs::file_type::directory && !is_one_of(name, known))
      throw Error(folder.string() + ": will not be overwritten, for it holds " + name.string() +
                  ", which is not of this command");
  }
  if (code) throw Error(folder.string() + ": cannot be listed: " + code.message());
}

void check_may_write(const fs::path& folder, const RunFolderOptions& options) {
  std::error_code code;
  const fs::file_status status = fs::status(folder, code);
  if (!fs::exists(status)) return;
  if (!fs::is_directory(status)) throw Error(folder.string() + ": is a file; name a folder for the output");
  struct statx seen {};
  if (::statx(AT_FDCWD, folder.c_str(), 0, STATX_TYPE, &seen) == 0 &&
      (seen.stx_attributes & STATX_ATTR_MOUNT_ROOT) != 0)
    throw Error(folder.string() + ": a disk is mounted there, so it cannot be replaced; name a folder in it");
  const bool empty = fs::is_empty(folder, code);
  if (code) throw Error(folder.string() + ": cannot be listed: " + code.message());
  if (empty) return;
  if (!options.overwrite)
    throw Error(folder.string() + ": exists already; name another folder or overwrite it");
  if (!fs::exists(folder / options.marker_file, code))
    throw Error(folder.string() + ": will not be overwritten, for it holds no " + options.marker_file +
                " and so was not made by this command");
  for (const fs::path& input : options.inputs)
    if (!input.empty() && lies_inside(input, folder))
      throw Error(folder.string() + ": will not be overwritten, for it holds the input " + input.string());
  check_entries(folder, options.known_entries);
  if (read_file(folder / options.marker_file).find(options.marker_text) == std::string::npos)
    throw Error(folder.string() + ": will not be overwritten, for its " + options.marker_file +
                " is not of this command");
}

fs::path sibling(const fs::path& folder, const std::string& ending) {
  return folder.parent_path() / (folder.filename().string() + ending);
}

/// Only the program that holds the lock of this temporary folder may write to `folder`.
fs::path temporary_of(const fs::path& folder) { return sibling(folder, ".gelslam-tmp"); }

void remove_contents(const fs::path& folder) {
  std::error_code code;
  std::vector<fs::path> left;
  for (fs::directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code))
    left.push_back(entry->path());
  for (const fs::path& one : left)
    if (!code) fs::remove_all(one, code);
  if (code) throw Error(folder.string() + ": cannot be emptied: " + code.message());
}

void rename_or_throw(const fs::path& from, const fs::path& to) {
  if (std::rename(from.c_str(), to.c_str()) != 0)
    throw Error(to.string() + ": cannot be written: " + errno_text());
}

/// Exchanges two folders.
void exchange(const fs::path& one, const fs::path& other) {
  if (::renameat2(AT_FDCWD, one.c_str(), AT_FDCWD, other.c_str(), RENAME_EXCHANGE) == 0) return;
  // For a file system without RENAME_EXCHANGE, such as NFS.
  const fs::path aside = sibling(other, ".gelslam-old");
  rename_or_throw(other, aside);
  rename_or_throw(one, other);
  rename_or_throw(aside, one);
}

}  // namespace

std::vector<std::string> saved_entries() {
  return {"mesh.ply",    "trajectory.tum",    "covariances.npy", "keyframes.tum", "pose_graph.g2o",
          "config.yaml", "loop_outliers.g2o", "report.json",     "session.db"};
}

std::vector<std::string> run_entries() {
  std::vector<std::string> entries;
  std::vector<std::string> names = saved_entries();
  names.insert(names.end(), {"session.db-wal", "session.db-shm", "screenshot_*.png"});
  for (const std::string& name : names)
    for (const fs::path folder : {"", kSaving})
      entries.insert(entries.end(), {folder / name, folder / (".tmp-[0-9]*-[0-9]*-" + name)});
  return entries;
}

bool is_one_of(const fs::path& path, const std::vector<std::string>& patterns) {
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
    return ::fnmatch(pattern.c_str(), path.c_str(), FNM_PATHNAME) == 0;
  });
}

void check_run_folder(const fs::path& folder, const RunFolderOptions& options) {
  const fs::path path = absolute_folder(folder);
  check_may_write(path, options);
  std::error_code code;
  for (const fs::path& used : {temporary_of(path), path})
    if (fs::is_directory(used, code)) FolderLock(used, path);
}

std::string left_behind(const fs::path& folder) {
  const fs::path temporary = temporary_of(absolute_folder(folder));
  std::error_code code;
  if (!fs::is_directory(temporary, code) || FolderLock::is_taken(temporary)) return "";
  return temporary.string() +
         " was left by a command that did not end: rename it to keep what it holds; the " +
         "next command that writes " + folder.string() + " removes it";
}

RunFolder::RunFolder(const fs::path& folder, const RunFolderOptions& options)
    : final_(absolute_folder(folder)), temporary_(temporary_of(final_)), options_(options) {
  check_may_write(final_, options_);
  std::error_code code;
  fs::create_directories(final_.parent_path(), code);
  if (code) throw Error(folder.string() + ": cannot be created: " + code.message());
  lock_temporary();
  try {
    lock_final();
    remove_contents(temporary_);  // Left by a program that was killed.
  } catch (const Error&) {
    fs::remove_all(temporary_, code);
    throw;
  }
}

void RunFolder::lock_temporary() {
  std::error_code code;
  fs::create_directory(temporary_, code);
  if (code) throw Error(final_.string() + ": cannot be created: " + code.message());
  if (fs::is_symlink(temporary_, code)) throw Error(temporary_.string() + ": is there; remove it");
  lock_ = FolderLock(temporary_, final_);
}

void RunFolder::lock_final() {
  std::error_code code;
  if (!final_lock_.holds() && fs::is_directory(final_, code)) final_lock_ = FolderLock(final_);
}

RunFolder::~RunFolder() {
  std::error_code ignored;
  if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
}

FolderLock RunFolder::commit() {
  try {
    put_in_place();
  } catch (const Error& error) {
    const std::string kept = std::exchange(temporary_, {}).string();
    throw Error(std::string(error.what()) + "; what was to be there is in " + kept);
  }
  return std::move(lock_);
}

bool RunFolder::replaces() const {
  std::error_code code;
  return final_lock_.holds() && !fs::is_empty(final_, code);
}

void RunFolder::put_in_place() {
  check_may_write(final_, options_);
  lock_final();  // Locks a folder that has appeared in the meantime.
  replaces() ? exchange(temporary_, final_) : rename_or_throw(temporary_, final_);
  sync_folder(final_.parent_path());
  std::error_code code;
  fs::remove_all(std::exchange(temporary_, {}), code);  // Removes the folder that was replaced.
  final_lock_ = FolderLock();
}

void check_run_files(const fs::path& folder) {
  std::error_code code;
  std::vector<std::string> known = saved_entries();
  known.insert(known.end(), {"session.db-wal", "session.db-shm", "log*.mkv"});
  for (fs::directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code)) {
    const fs::path name = entry->path().filename();
    if (name == "session.db-journal")  // SQLite would apply such a journal, which can refer to other files.
      throw Error(entry->path().string() + ": no run holds that; remove it");
    const fs::file_type type = entry->symlink_status(code).type();
    if (type != fs::file_type::regular && type != fs::file_type::directory && is_one_of(name, known))
      throw Error(entry->path().string() + ": is a link, pipe or device, which no run holds there");
  }
}

void refuse_unfinished(const fs::path& folder) {
  const FolderLock nobody_writes(folder);
  throw Error(folder.string() +
              ": the scan was not finished; fuse the run to make its map and mesh, or continue the scan");
}

void check_save(const fs::path& folder) {
  std::error_code code;
  for (fs::directory_iterator entry(folder / kSaving, code), end; !code && entry != end;
       entry.increment(code))
    if (entry->is_directory() || !is_one_of(kSaving / entry->path().filename(), run_entries()))
      throw Error(entry->path().string() + ": is not of this program, which would remove it; move it away");
}

bool is_unfinished(const fs::path& folder) {
  const std::optional<RunReport> report = find_report(folder);
  return report && report->saved == false;
}

void check_is_run(const fs::path& folder, RunNeeds needs) {
  std::error_code code;
  if (!fs::is_directory(folder, code)) throw Error(folder.string() + ": no such run folder");
  check_run_files(folder);
  if (needs == RunNeeds::map && is_unfinished(folder)) refuse_unfinished(folder);
  const auto holds = [&](const char* entry) { return fs::exists(folder / entry, code); };
  if (holds("mesh.ply") || holds("trajectory.tum")) return;
  if (!holds("session.db"))
    throw Error(folder.string() + ": is no run folder (no session.db, mesh.ply or trajectory.tum)");
  if (needs == RunNeeds::map) refuse_unfinished(folder);
}

fs::path RunFiles::mesh_file() const {
  const bool is_empty = folder.empty() || (report && report->mesh.triangles == 0);
  return !is_empty && fs::exists(folder / "mesh.ply") ? folder / "mesh.ply" : "";
}

RunFiles read_run_files(const fs::path& folder) {
  check_is_run(folder);
  const auto poses = [&](const char* name) {
    return fs::exists(folder / name) ? read_tum(folder / name) : std::vector<StampedPose>();
  };
  RunFiles files{folder, find_report(folder), poses("trajectory.tum"), poses("keyframes.tum")};
  if (fs::exists(folder / "covariances.npy")) read_covariances(folder / "covariances.npy", files.trajectory);
  return files;
}

}  // namespace gelslam
