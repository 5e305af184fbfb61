#include "gelslam/core/swapped_bytes.hpp"

#include <sys/mman.h>

#include <cstdlib>

#include "gelslam/core/file_descriptor.hpp"

namespace gelslam {

/// Mapped from a file of its own, which nobody else can write to, also after a fork().
struct SwappedBytes::Block {
  explicit Block(std::string bytes) : size(bytes.size()) {
    const char* const folder = std::getenv("TMPDIR");
    const FileDescriptor file(
        ::open(folder && *folder ? folder : "/var/tmp", O_TMPFILE | O_RDWR | O_CLOEXEC, S_IRUSR | S_IWUSR));
    if (file.ok() && size > 0 && ::write(file.get(), bytes.data(), size) == static_cast<ssize_t>(size))
      mapped = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, file.get(), 0);
    if (mapped == MAP_FAILED) in_memory = std::move(bytes);
  }
  ~Block() {
    if (mapped != MAP_FAILED) ::munmap(mapped, size);
  }
  Block(const Block&) = delete;
  Block& operator=(const Block&) = delete;

  std::size_t size;
  void* mapped = MAP_FAILED;
  std::string in_memory;
};

SwappedBytes::SwappedBytes(std::string bytes) : block_(std::make_shared<const Block>(std::move(bytes))) {}

std::string SwappedBytes::read() const {
  if (block_->mapped == MAP_FAILED) return block_->in_memory;
  std::string bytes(static_cast<const char*>(block_->mapped), block_->size);
  ::madvise(block_->mapped, block_->size, MADV_DONTNEED);  // of the process's memory; the file keeps them
  return bytes;
}

}  // namespace gelslam
