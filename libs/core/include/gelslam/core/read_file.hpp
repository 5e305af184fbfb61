#pragma once

#include <filesystem>
#include <string>

namespace gelslam {

/// All bytes of a file. Throws Error that names it and says why it cannot be read.
std::string read_file(const std::filesystem::path& path);

}  // namespace gelslam
