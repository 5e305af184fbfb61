#pragma once

#include <initializer_list>
#include <string>

namespace gelslam::detail {

/// "first; second", without those that are empty.
inline std::string joined(std::initializer_list<std::string> warnings) {
  std::string text;
  for (const std::string& warning : warnings)
    if (!warning.empty()) text += (text.empty() ? "" : "; ") + warning;
  return text;
}

}  // namespace gelslam::detail
