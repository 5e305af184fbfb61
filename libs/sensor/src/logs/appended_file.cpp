#include "logs/appended_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "gelslam/core/error.hpp"

namespace gelslam::detail {
AppendedFile::AppendedFile(const std::filesystem::path& path)
    : file_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666)) {
  if (file_.ok()) return;
  if (errno == EEXIST) throw Error(path.string() + ": exists already; name another file");
  throw Error(path.string() + ": cannot be created: " + errno_text());
}

std::string AppendedFile::append(std::string_view first, std::string_view second) {
  std::string_view parts[] = {first, second};
  while (!parts[0].empty() || !parts[1].empty()) {
    const iovec vectors[] = {{const_cast<char*>(parts[0].data()), parts[0].size()},
                             {const_cast<char*>(parts[1].data()), parts[1].size()}};
    const ssize_t written = ::writev(file_.get(), vectors, 2);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      const std::string message = written < 0 ? errno_text() : "nothing was taken";
      // Best effort: where it fails, a reader still stops before the torn piece.
      if (::ftruncate(file_.get(), size_) == 0) ::lseek(file_.get(), size_, SEEK_SET);
      return message;
    }
    auto left = static_cast<std::size_t>(written);
    for (std::string_view& part : parts) {
      const std::size_t taken = std::min(left, part.size());
      part.remove_prefix(taken);
      left -= taken;
    }
  }
  size_ += static_cast<std::int64_t>(first.size() + second.size());
  return "";
}

std::string AppendedFile::overwrite(std::size_t at, std::string_view bytes) {
  const ssize_t written = ::pwrite(file_.get(), bytes.data(), bytes.size(), static_cast<off_t>(at));
  if (written < 0) return errno_text();
  return static_cast<std::size_t>(written) == bytes.size() ? "" : "not all was taken";
}

bool AppendedFile::removed() const {
  struct stat status {};
  return ::fstat(file_.get(), &status) == 0 && status.st_nlink == 0;
}

std::string AppendedFile::sync() { return ::fsync(file_.get()) == 0 ? "" : errno_text(); }

}  // namespace gelslam::detail
