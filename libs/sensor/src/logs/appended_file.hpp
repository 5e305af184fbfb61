#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "gelslam/core/file_descriptor.hpp"

namespace gelslam::detail {

/// A file that only grows, by whole pieces: a piece that does not fit any more (full disk, file size limit)
/// leaves nothing of itself behind. Pieces go straight to the system, nothing is kept back in this program.
class AppendedFile {
 public:
  /// Throws Error when the file exists or cannot be created.
  explicit AppendedFile(const std::filesystem::path& path);

  /// "" or what the system says was wrong.
  std::string append(std::string_view first, std::string_view second);
  /// Replaces bytes that were written before.
  std::string overwrite(std::size_t at, std::string_view bytes);
  /// Forces all to the disk.
  std::string sync();
  /// Somebody has taken the file away meanwhile: it has no name any more.
  bool removed() const;
  std::int64_t size() const { return size_; }

 private:
  FileDescriptor file_;
  std::int64_t size_ = 0;
};

}  // namespace gelslam::detail
