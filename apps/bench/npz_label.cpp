#include "npz_label.hpp"

#include <unistd.h>
#include <zip.h>

#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/core/npy.hpp"

namespace gelslam::bench {
namespace {

constexpr zip_uint64_t max_entry_bytes = 4096;

// The numbers of one .npy inside the archive (through a temporary file, which is what read_npy reads).
std::vector<double> read_entry(zip_t* archive, const std::string& name, const std::filesystem::path& path) {
  const auto damaged = [&] { return Error("'" + path.string() + "': '" + name + "' is missing or damaged"); };
  zip_stat_t info;
  if (zip_stat(archive, name.c_str(), 0, &info) != 0 || info.size > max_entry_bytes) throw damaged();
  const std::unique_ptr<zip_file_t, int (*)(zip_file_t*)> entry(zip_fopen(archive, name.c_str(), 0),
                                                                &zip_fclose);
  std::vector<char> bytes(info.size);
  if (!entry || zip_fread(entry.get(), bytes.data(), info.size) != static_cast<zip_int64_t>(info.size))
    throw damaged();
  std::string temporary = (std::filesystem::temp_directory_path() / "gelslam-label-XXXXXX").string();
  const int descriptor = ::mkstemp(temporary.data());
  if (descriptor < 0)
    throw Error("cannot write into '" + std::filesystem::temp_directory_path().string() + "'");
  ::close(descriptor);
  std::ofstream(temporary, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  try {
    std::vector<double> values = read_npy(temporary).to_doubles();
    std::filesystem::remove(temporary);
    return values;
  } catch (const Error&) {
    std::filesystem::remove(temporary);
    throw damaged();
  }
}

}  // namespace

Circle read_npz_label(const std::filesystem::path& path) {
  int error = 0;
  const std::unique_ptr<zip_t, void (*)(zip_t*)> archive(zip_open(path.c_str(), ZIP_RDONLY, &error),
                                                         &zip_discard);
  if (!archive) throw Error("'" + path.string() + "' is no npz archive");
  const std::vector<double> center = read_entry(archive.get(), "center.npy", path);
  const std::vector<double> radius = read_entry(archive.get(), "radius.npy", path);
  if (center.size() != 2 || radius.size() != 1)
    throw Error("'" + path.string() + "': expected center (2) and radius (1)");
  return {center[0], center[1], radius[0]};
}

}  // namespace gelslam::bench
