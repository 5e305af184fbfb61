#pragma once

#include <cstdlib>
#include <filesystem>

namespace gelslam::test {

/// Real data and sequences: GELSLAM_DATA, or ../shared/data beside the checkout. It may not be there.
inline std::filesystem::path data_folder() {
  const char* given = std::getenv("GELSLAM_DATA");
  return given != nullptr ? given : GELSLAM_DEFAULT_DATA;
}

}  // namespace gelslam::test
