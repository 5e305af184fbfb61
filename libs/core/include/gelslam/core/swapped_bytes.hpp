#pragma once

#include <memory>
#include <string>

namespace gelslam {

/// Bytes that are seldom read. They lie on disk, in a file without a name that ends with the process, in
/// $TMPDIR or else /var/tmp; in memory where no such file can be made or the disk is full. Immutable, cheap
/// to copy, thread-safe.
class SwappedBytes {
 public:
  explicit SwappedBytes(std::string bytes = {});

  /// Throws Error when they cannot be read from the disk.
  std::string read() const;

 private:
  struct Block;
  std::shared_ptr<const Block> block_;
};

}  // namespace gelslam
