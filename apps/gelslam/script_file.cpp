#include "script_file.hpp"

#include <fstream>
#include <iterator>

#include "gelslam/core/error.hpp"

namespace gelslam {

std::string read_script_file(const std::filesystem::path& file) {
  if (file.empty()) return "";
  std::ifstream stream(file);
  if (!stream || std::filesystem::is_directory(file))
    throw Error(file.string() + ": cannot read the script: no file, or it cannot be read");
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace gelslam
