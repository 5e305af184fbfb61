#include "file_bytes.hpp"

#include <fstream>
#include <system_error>

#include "gelslam/core/error.hpp"

namespace gelslam::mesh::detail {

std::string read_file_bytes(const std::filesystem::path& path) {
  constexpr std::uintmax_t max_bytes = 8ull << 30;
  std::error_code ec;
  const std::uintmax_t size = std::filesystem::file_size(path, ec);
  if (ec) throw Error("it cannot be opened: " + ec.message());
  if (size > max_bytes) throw Error("it is larger than 8 GB");
  std::ifstream file(path, std::ios::binary);
  std::string bytes(static_cast<std::size_t>(size), '\0');
  if (!file.read(bytes.data(), static_cast<std::streamsize>(size))) throw Error("it cannot be read");
  return bytes;
}

}  // namespace gelslam::mesh::detail
