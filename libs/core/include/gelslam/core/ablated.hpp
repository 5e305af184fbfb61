#pragma once

#include <cstdlib>
#include <string>
#include <string_view>

namespace gelslam {

/// Whether the environment variable GELSLAM_WITHOUT (names separated by commas) names this mechanism. Only for the
/// ablation study: this commit is not part of the program.
inline bool ablated(std::string_view mechanism) {
  static const std::string names = [] {
    const char* const value = std::getenv("GELSLAM_WITHOUT");
    return "," + std::string(value ? value : "") + ",";
  }();
  return names.find("," + std::string(mechanism) + ",") != std::string::npos;
}

}  // namespace gelslam
