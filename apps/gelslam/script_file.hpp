#pragma once

#include <filesystem>
#include <string>

namespace gelslam {

/// The text of a window script; "" for an empty name. Throws Error when the file cannot be read.
std::string read_script_file(const std::filesystem::path& file);

}  // namespace gelslam
