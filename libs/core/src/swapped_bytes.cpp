#include "gelslam/core/swapped_bytes.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <mutex>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/file_descriptor.hpp"

namespace gelslam {
namespace core::detail {

/// A file without a name, to which blocks are appended. What is released becomes a hole in it.
class SwapFile {
 public:
  SwapFile() {
    const char* folder = std::getenv("TMPDIR");
    file_ = FileDescriptor(
        ::open(folder && *folder ? folder : "/var/tmp", O_TMPFILE | O_RDWR | O_CLOEXEC, S_IRUSR | S_IWUSR));
  }

  /// That of this process: a fork() begins its own, so that it does not write over its parent's blocks.
  static std::shared_ptr<SwapFile> of_process() {
    static std::mutex& mutex = *new std::mutex;  // never destroyed: other statics may hold bytes
    static std::shared_ptr<SwapFile>& file = *new std::shared_ptr<SwapFile>;
    const std::lock_guard lock(mutex);
    if (!file || file->owner_ != ::getpid()) file = std::make_shared<SwapFile>();
    return file;
  }

  /// Where the bytes lie; negative when the disk does not take them.
  off_t append(const std::string& bytes) {
    off_t offset = 0;
    {
      const std::lock_guard lock(mutex_);
      offset = std::exchange(end_, end_ + static_cast<off_t>(bytes.size()));
    }
    for (std::size_t done = 0; done < bytes.size();) {
      const ssize_t written =
          ::pwrite(file_.get(), bytes.data() + done, bytes.size() - done, offset + static_cast<off_t>(done));
      if (written <= 0) return -1;
      done += static_cast<std::size_t>(written);
    }
    return offset;
  }

  bool read(off_t offset, std::string& bytes) const {
    for (std::size_t done = 0; done < bytes.size();) {
      const ssize_t got =
          ::pread(file_.get(), bytes.data() + done, bytes.size() - done, offset + static_cast<off_t>(done));
      if (got <= 0) return false;
      done += static_cast<std::size_t>(got);
    }
    return true;
  }

  /// Best effort: not every file system can.
  void release(off_t offset, std::size_t size) const {
    if (owner_ == ::getpid())
      ::fallocate(file_.get(), FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, offset, static_cast<off_t>(size));
  }

 private:
  const pid_t owner_ = ::getpid();
  FileDescriptor file_;
  std::mutex mutex_;
  off_t end_ = 0;
};

}  // namespace core::detail

using core::detail::SwapFile;

struct SwappedBytes::Block {
  explicit Block(std::string bytes) : size(bytes.size()), file(SwapFile::of_process()) {
    offset = file->append(bytes);
    if (offset < 0) in_memory = std::move(bytes);
  }
  ~Block() {
    if (offset >= 0) file->release(offset, size);
  }
  Block(const Block&) = delete;
  Block& operator=(const Block&) = delete;

  std::size_t size;
  std::shared_ptr<SwapFile> file;
  off_t offset = -1;  // negative: in memory
  std::string in_memory;
};

SwappedBytes::SwappedBytes(std::string bytes) : block_(std::make_shared<const Block>(std::move(bytes))) {}

std::string SwappedBytes::read() const {
  if (block_->offset < 0) return block_->in_memory;
  std::string bytes(block_->size, '\0');
  if (!block_->file->read(block_->offset, bytes))
    throw Error("cannot read from the temporary file of this program: " + errno_text());
  return bytes;
}

}  // namespace gelslam
