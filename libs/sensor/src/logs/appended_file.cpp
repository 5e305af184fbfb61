#include "logs/appended_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "gelslam/core/error.hpp"

namespace gelslam::detail {
namespace {

std::string system_message() { return std::generic_category().message(errno); }

}  // namespace

AppendedFile::AppendedFile(const std::filesystem::path& path)
    : descriptor_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666)) {
  if (descriptor_ >= 0) return;
  if (errno == EEXIST) throw Error(path.string() + ": exists already; name another file");
  throw Error(path.string() + ": cannot be created: " + system_message());
}

AppendedFile::~AppendedFile() { ::close(descriptor_); }

std::string AppendedFile::append(std::string_view first, std::string_view second) {
  std::string_view parts[] = {first, second};
  while (!parts[0].empty() || !parts[1].empty()) {
    const iovec vectors[] = {{const_cast<char*>(parts[0].data()), parts[0].size()},
                             {const_cast<char*>(parts[1].data()), parts[1].size()}};
    const ssize_t written = ::writev(descriptor_, vectors, 2);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      const std::string message = written < 0 ? system_message() : "nothing was taken";
      // Best effort: where it fails, a reader still stops before the torn piece.
      if (::ftruncate(descriptor_, size_) == 0) ::lseek(descriptor_, size_, SEEK_SET);
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
  const ssize_t written = ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(at));
  if (written < 0) return system_message();
  return static_cast<std::size_t>(written) == bytes.size() ? "" : "not all was taken";
}

bool AppendedFile::removed() const {
  struct stat status {};
  return ::fstat(descriptor_, &status) == 0 && status.st_nlink == 0;
}

std::string AppendedFile::sync() { return ::fsync(descriptor_) == 0 ? "" : system_message(); }

}  // namespace gelslam::detail
