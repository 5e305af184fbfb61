#include "gelslam/core/npy.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "npy_header.hpp"

namespace gelslam {
namespace {

static_assert(std::endian::native == std::endian::little, "elements are copied as they are");

constexpr std::string_view kMagic{"\x93NUMPY", 6};
constexpr std::size_t kLongestHeader = 1u << 16;

struct TypeName {
  NpyType type;
  std::string_view descr;
  std::size_t bytes;
};
constexpr TypeName kTypeNames[] = {{NpyType::float16, "<f2", 2}, {NpyType::float32, "<f4", 4},
                                   {NpyType::float64, "<f8", 8}, {NpyType::int64, "<i8", 8},
                                   {NpyType::uint8, "|u1", 1},   {NpyType::boolean, "|b1", 1}};

const TypeName& name_of(NpyType type) {
  return *std::find_if(std::begin(kTypeNames), std::end(kTypeNames),
                       [&](const TypeName& n) { return n.type == type; });
}

/// Number of elements, or nothing when it does not fit into `limit`.
std::optional<std::size_t> checked_size(const std::vector<std::size_t>& shape, std::size_t limit) {
  if (std::find(shape.begin(), shape.end(), 0u) != shape.end()) return 0;
  std::size_t size = 1;
  for (const std::size_t extent : shape) {
    if (extent > limit / size) return std::nullopt;
    size *= extent;
  }
  return size;
}

std::string read_exactly(std::istream& file, std::size_t bytes) {
  std::string buffer(bytes, '\0');
  file.read(buffer.data(), static_cast<std::streamsize>(bytes));
  if (static_cast<std::size_t>(file.gcount()) != bytes) throw std::invalid_argument("it is truncated");
  return buffer;
}

detail::NpyHeader read_header(std::istream& file) {
  if (read_exactly(file, kMagic.size()) != kMagic)
    throw std::invalid_argument("it does not start with \\x93NUMPY");
  const std::string version = read_exactly(file, 2);
  if (version[0] < 1 || version[0] > 3) throw std::invalid_argument("its format version is unknown");
  const std::string length_bytes = read_exactly(file, version[0] == 1 ? 2 : 4);
  std::size_t length = 0;
  for (std::size_t i = length_bytes.size(); i-- > 0;)
    length = length << 8 | static_cast<unsigned char>(length_bytes[i]);
  if (length > kLongestHeader) throw std::invalid_argument("its header is too long");
  return detail::parse_npy_header(read_exactly(file, length));
}

/// The file is as long as its header says, and the array no longer than `max_bytes`.
NpyArray read_array(std::istream& file, std::size_t max_bytes) {
  const detail::NpyHeader header = read_header(file);
  const auto* known = std::find_if(std::begin(kTypeNames), std::end(kTypeNames),
                                   [&](const TypeName& n) { return n.descr == header.descr; });
  if (known == std::end(kTypeNames))
    throw std::invalid_argument("its element type " + header.descr + " is none of <f2 <f4 <f8 <i8 |u1 |b1");
  if (header.fortran_order && header.shape.size() > 1)
    throw std::invalid_argument("it is in Fortran order; save it with numpy.ascontiguousarray");
  const auto size = checked_size(header.shape, max_bytes / known->bytes);
  if (!size) throw std::invalid_argument("it claims more than " + std::to_string(max_bytes) + " bytes");
  const std::streampos data_start = file.tellg();
  file.seekg(0, std::ios::end);
  const auto left = static_cast<std::size_t>(file.tellg() - data_start);
  // Compared before allocating: a header of a few bytes must not cost gigabytes.
  if (left < *size * known->bytes) throw std::invalid_argument("it is truncated");
  if (left > *size * known->bytes) throw std::invalid_argument("it is longer than its header says");
  file.seekg(data_start);
  NpyArray array{known->type, header.shape, std::vector<std::byte>(left)};
  file.read(reinterpret_cast<char*>(array.data.data()), static_cast<std::streamsize>(left));
  if (!file) throw std::invalid_argument("it cannot be read to its end");
  return array;
}

NpyArray read_named(std::istream& file, std::size_t max_bytes, const std::string& name) {
  try {
    return read_array(file, max_bytes);
  } catch (const std::invalid_argument& problem) {
    throw Error(name + ": not a usable .npy file: " + problem.what());
  }
}

std::ifstream open_file(const std::filesystem::path& path) {
  std::error_code code;
  if (!std::filesystem::is_regular_file(path, code)) throw Error(path.string() + ": no such file");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(path.string() + ": cannot be opened; check its permissions");
  refuse_lfs_pointer(path);
  return file;
}

template <class T>
std::vector<double> converted(const std::vector<std::byte>& data) {
  std::vector<double> values(data.size() / sizeof(T));
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::array<std::byte, sizeof(T)> element;
    std::memcpy(element.data(), data.data() + i * sizeof(T), sizeof(T));
    values[i] = static_cast<double>(std::bit_cast<T>(element));
  }
  return values;
}

/// All that stands before the elements.
std::string format_start(NpyType type, const std::vector<std::size_t>& shape) {
  std::string header = detail::format_npy_header({std::string(name_of(type).descr), false, shape});
  const std::size_t prefix = kMagic.size() + 4;
  header.append(63 - (prefix + header.size()) % 64, ' ');  // data aligned to 64 bytes, as numpy has it
  header += '\n';
  std::string contents(kMagic);
  contents +=
      {'\x01', '\x00', static_cast<char>(header.size() & 0xff), static_cast<char>(header.size() >> 8)};
  return contents + header;
}

std::string format_array(NpyType type, const std::vector<std::size_t>& shape, std::string_view bytes) {
  const std::size_t element = name_of(type).bytes;
  const auto size = checked_size(shape, bytes.size() / element);
  if (!size || *size * element != bytes.size())
    throw std::invalid_argument("write_npy: values do not fit the shape");
  return format_start(type, shape).append(bytes);
}

void write_array(const std::filesystem::path& path, NpyType type, const std::vector<std::size_t>& shape,
                 std::string_view bytes) {
  write_file_atomically(path, format_array(type, shape, bytes));
}

template <class T>
std::string_view bytes_of(std::span<const T> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

}  // namespace

std::size_t NpyArray::size() const { return data.size() / name_of(type).bytes; }

std::vector<double> NpyArray::to_doubles() const {
  switch (type) {
    case NpyType::float16:
      return converted<Eigen::half>(data);
    case NpyType::float32:
      return converted<float>(data);
    case NpyType::float64:
      return converted<double>(data);
    case NpyType::int64:
      return converted<std::int64_t>(data);
    case NpyType::uint8:
      return converted<std::uint8_t>(data);
    case NpyType::boolean:
      break;
  }
  std::vector<double> values(data.size());
  std::transform(data.begin(), data.end(), values.begin(),
                 [](std::byte b) { return b == std::byte{0} ? 0.0 : 1.0; });
  return values;
}

NpyArray read_npy(const std::filesystem::path& path, std::size_t max_bytes) {
  std::ifstream file = open_file(path);
  return read_named(file, max_bytes, path.string());
}

NpyArray parse_npy(std::string_view bytes, const std::string& name) {
  std::istringstream stream{std::string(bytes)};
  return read_named(stream, bytes.size(), name);
}

std::string format_npy(const std::vector<std::size_t>& shape, std::span<const double> values) {
  return format_array(NpyType::float64, shape, bytes_of(values));
}

void write_npy(const std::filesystem::path& path, const std::vector<std::size_t>& shape,
               std::span<const double> values) {
  write_array(path, NpyType::float64, shape, bytes_of(values));
}
void write_npy(const std::filesystem::path& path, const std::vector<std::size_t>& shape,
               std::span<const float> values) {
  write_array(path, NpyType::float32, shape, bytes_of(values));
}

}  // namespace gelslam
