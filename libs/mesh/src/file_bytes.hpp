#pragma once

#include <filesystem>
#include <string>

namespace gelslam::mesh::detail {

/// The whole file. Throws Error when it cannot be opened or read, or is larger than 8 GB.
std::string read_file_bytes(const std::filesystem::path& path);

}  // namespace gelslam::mesh::detail
