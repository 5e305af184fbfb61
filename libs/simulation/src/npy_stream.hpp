#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "gelslam/core/atomic_file.hpp"

namespace gelslam::simulation::detail {

/// A .npy file (version 1.0, C order) written piece by piece: truth maps of a long scan do not fit in memory.
class NpyStream {
 public:
  /// `type`: numpy's name, "<f4" or "|b1".
  NpyStream(const std::filesystem::path& path, const std::string& type,
            const std::vector<std::size_t>& shape);
  /// Throws Error on a full disk.
  void add(const void* data, std::size_t bytes);
  void finish();

 private:
  TemporaryFile file_;
  std::filesystem::path path_;
  std::ofstream stream_;
};

}  // namespace gelslam::simulation::detail
