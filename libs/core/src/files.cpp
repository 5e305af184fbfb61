#include "gelslam/core/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <system_error>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

void write_all(const FileDescriptor& file, std::string_view contents, const fs::path& path) {
  while (!contents.empty()) {
    const ssize_t written = ::write(file.get(), contents.data(), contents.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) throw Error(path.string() + ": cannot be written: " + errno_text());
    contents.remove_prefix(static_cast<std::size_t>(written));
  }
}

bool is_device_or_pipe(const fs::path& path) {
  std::error_code code;
  return fs::is_other(fs::status(path, code));
}

fs::path resolve_link(const fs::path& path) {
  std::error_code code;
  if (!fs::is_symlink(path, code)) return path;
  fs::path target = fs::weakly_canonical(path, code);
  return code ? path : target;
}

/// Removes temporary files for `path` whose programs have ended and therefore hold no lock.
void remove_left_behind(const fs::path& path) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : ".";
  std::error_code code;
  for (fs::directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code)) {
    const std::string name = entry->path().filename().string();
    int process = 0, attempt = 0, used = 0;
    if (std::sscanf(name.c_str(), ".tmp-%d-%d-%n", &process, &attempt, &used) != 2 || used == 0 ||
        name.substr(static_cast<std::size_t>(used)) != path.filename() ||
        !fs::is_regular_file(entry->symlink_status(code)))
      continue;
    const FileDescriptor file(::open(entry->path().c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC));
    std::error_code ignored;
    if (file.ok() && ::flock(file.get(), LOCK_EX | LOCK_NB) == 0) fs::remove(entry->path(), ignored);
  }
}

/// Returns " (gelslam, process 123)": the holder of the lock according to the kernel; "" if it does not tell.
std::string holder_of(const FileDescriptor& directory) {
  struct stat status {};
  if (::fstat(directory.get(), &status) != 0) return "";
  const std::string locked =
      fmt::format("{:02x}:{:02x}:{}", major(status.st_dev), minor(status.st_dev), status.st_ino);
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream words(line);
    std::string number, kind, mode, access, file, name;
    int process = 0;
    if (!(words >> number >> kind >> mode >> access >> process >> file) || kind != "FLOCK" || process <= 0 ||
        file != locked)
      continue;
    std::ifstream comm("/proc/" + std::to_string(process) + "/comm");
    if (std::getline(comm, name)) name += ", ";
    return fmt::format(" ({}process {})", name, process);
  }
  return "";
}

}  // namespace

TemporaryFile::TemporaryFile(const fs::path& final_path) : final_path_(resolve_link(final_path)) {
  std::error_code code;
  if (!final_path_.has_filename()) throw Error("'" + final_path.string() + "' is not the name of a file");
  if (fs::is_directory(final_path_, code))
    throw Error(final_path.string() + ": is a folder, a file is to be written");
  remove_left_behind(final_path_);
  for (int attempt = 0;; ++attempt) {
    std::string name =
        ".tmp-";  // built by +=: g++ 12 warns falsely (-Wrestrict) about literal + std::to_string
    name +=
        std::to_string(::getpid()) + "-" + std::to_string(attempt) + "-" + final_path_.filename().string();
    temporary_path_ = final_path_.parent_path() / name;
    lock_ = FileDescriptor(::open(temporary_path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    struct stat status {};
    if (lock_.ok() && (::flock(lock_.get(), LOCK_EX | LOCK_NB) != 0 || ::fstat(lock_.get(), &status) != 0 ||
                       status.st_nlink > 0))
      return;
    if (!lock_.ok() && errno != EEXIST)
      throw Error(final_path.string() + ": cannot be created: " + errno_text());
  }
}

TemporaryFile::~TemporaryFile() {
  std::error_code ignored;
  if (!temporary_path_.empty()) fs::remove(temporary_path_, ignored);
}

void TemporaryFile::commit() {
  const FileDescriptor file(::open(temporary_path_.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file.ok() || ::fsync(file.get()) != 0 || ::rename(temporary_path_.c_str(), final_path_.c_str()) != 0)
    throw Error(final_path_.string() + ": cannot be written: " + errno_text());
  temporary_path_.clear();
  sync_folder(final_path_.parent_path());
}

void write_file_atomically(const fs::path& path, std::string_view contents) {
  if (is_device_or_pipe(path)) {
    const FileDescriptor device(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    if (!device.ok()) throw Error(path.string() + ": cannot be opened: " + errno_text());
    write_all(device, contents, path);
    return;
  }
  TemporaryFile temporary(path);
  const FileDescriptor file(::open(temporary.path().c_str(), O_WRONLY | O_CLOEXEC));
  if (!file.ok()) throw Error(path.string() + ": cannot be written: " + errno_text());
  write_all(file, contents, path);
  temporary.commit();
}

std::string read_file(const std::filesystem::path& path) {
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  std::string bytes;
  std::array<char, 1 << 16> block;
  constexpr std::size_t kMaxBytes = std::size_t{1} << 30;
  while (file.ok()) {
    if (bytes.size() > kMaxBytes) throw Error(path.string() + ": is larger than 1 GiB");
    const ssize_t count = ::read(file.get(), block.data(), block.size());
    if (count == 0) return bytes;
    if (count > 0) bytes.append(block.data(), static_cast<std::size_t>(count));
    if (count < 0 && errno != EINTR) break;
  }
  throw Error(path.string() + ": cannot be read: " + errno_text());
}

void refuse_lfs_pointer(const std::filesystem::path& path) {
  constexpr std::string_view kBeginning = "version https://git-lfs.github.com/";
  std::string beginning(kBeginning.size(), '\0');
  std::ifstream(path, std::ios::binary)
      .read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
  if (beginning == kBeginning)
    throw Error(path.string() + ": only a Git LFS pointer to the file; run git lfs pull in its repository");
}

std::string name_of(const fs::path& path) {
  const fs::path clean = path.lexically_normal();
  return (clean.has_filename() ? clean : clean.parent_path()).filename().string();
}

FolderLock::FolderLock(const fs::path& folder, const fs::path& shown) {
  const std::string name = quoted(shown.empty() ? folder : shown);
  do {
    directory_ = FileDescriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!directory_.ok()) throw Error(name + " cannot be opened: " + errno_text());
    if (::flock(directory_.get(), LOCK_EX | LOCK_NB) == 0) continue;
    if (errno != EWOULDBLOCK) return;
    throw Error("another program" + holder_of(directory_) + " is writing to " + name +
                ": end it first, or name another folder");
  } while (!leads_to(folder, directory_));
}

bool FolderLock::is_of(const fs::path& folder) const {
  return directory_.ok() && leads_to(folder, directory_);
}

bool FolderLock::is_taken(const fs::path& folder) {
  const FileDescriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return directory.ok() && ::flock(directory.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
}

}  // namespace gelslam
