#include "picture_name.hpp"

#include <filesystem>

#include "gelslam/core/text.hpp"

namespace gelslam {

std::string refuse_unless_png(const std::string& path) {
  if (lower_case(std::filesystem::path(path).extension().string()) == ".png") return "";
  return path + ": pictures are written as PNG; give a name that ends in .png";
}

}  // namespace gelslam
