#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace gelslam {

struct ZipEntry {
  std::string name, contents;
};

/// Limits for a file of unknown origin.
struct ZipLimits {
  std::size_t entries = 64;
  std::size_t entry_bytes = 64 * 1024;
};

/// Reads all entries of a zip archive and verifies their checksums. `name` stands for it in errors. Throws
/// Error when it is damaged, no zip archive, or larger than `limits`.
std::vector<ZipEntry> parse_zip(std::string_view bytes, const std::string& name,
                                const ZipLimits& limits = {});

/// Writes entries without compression (as PyTorch requires) and with a fixed date, so that the same entries
/// give the same bytes. The file appears when it is complete. Throws Error when it cannot be written.
void write_zip(const std::filesystem::path& path, const std::vector<ZipEntry>& entries);

}  // namespace gelslam
