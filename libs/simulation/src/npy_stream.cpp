#include "npy_stream.hpp"

#include "gelslam/core/error.hpp"

namespace gelslam::simulation::detail {

NpyStream::NpyStream(const std::filesystem::path& path, const std::string& type,
                     const std::vector<std::size_t>& shape)
    : file_(path), path_(path), stream_(file_.path(), std::ios::binary) {
  std::string text = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (";
  for (const std::size_t size : shape) text += std::to_string(size) + ", ";
  text += "), }";
  constexpr std::size_t preamble = 10, alignment = 64;
  while ((preamble + text.size() + 1) % alignment != 0) text.push_back(' ');
  text.push_back('\n');
  std::string header = "\x93NUMPY\x01";
  header.push_back('\0');
  header.push_back(static_cast<char>(text.size() & 0xff));
  header.push_back(static_cast<char>(text.size() >> 8));
  header.append(text);
  add(header.data(), header.size());
}

void NpyStream::add(const void* data, std::size_t bytes) {
  stream_.write(static_cast<const char*>(data), static_cast<std::streamsize>(bytes));
  if (!stream_) throw Error("cannot write " + path_.string() + "; is the disk full?");
}

void NpyStream::finish() {
  stream_.close();
  if (!stream_) throw Error("cannot write " + path_.string() + "; is the disk full?");
  file_.commit();
}

}  // namespace gelslam::simulation::detail
