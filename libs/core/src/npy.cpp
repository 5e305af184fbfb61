#include "gelslam/core/npy.hpp"

#include <fmt/core.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"

namespace gelslam {
namespace {

static_assert(std::endian::native == std::endian::little, "elements are copied as they are");

constexpr std::string_view kMagic{"\x93NUMPY", 6};
constexpr std::size_t kLongestHeader = 1u << 16;
constexpr std::size_t kMaxDimensions = 32;  // numpy's own limit

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

std::vector<double> converted_flags(const std::vector<std::byte>& data) {
  std::vector<double> values(data.size());
  std::ranges::transform(data, values.begin(), [](std::byte b) { return b == std::byte{0} ? 0.0 : 1.0; });
  return values;
}

struct TypeName {
  NpyType type;
  std::string_view descr;
  std::size_t bytes;
  std::vector<double> (*to_doubles)(const std::vector<std::byte>&);
};
constexpr TypeName kTypeNames[] = {
    {NpyType::float16, "<f2", 2, converted<Eigen::half>}, {NpyType::float32, "<f4", 4, converted<float>},
    {NpyType::float64, "<f8", 8, converted<double>},      {NpyType::int64, "<i8", 8, converted<std::int64_t>},
    {NpyType::uint8, "|u1", 1, converted<std::uint8_t>},  {NpyType::boolean, "|b1", 1, converted_flags}};

const TypeName& name_of(NpyType type) { return *std::ranges::find(kTypeNames, type, &TypeName::type); }

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

struct Header {
  std::string descr;
  bool fortran_order = false;
  std::vector<std::size_t> shape;
};

std::size_t extent_of(std::string text) {
  if (text.ends_with('L')) text.pop_back();  // written by Python 2
  std::size_t extent = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), extent);
  if (error != std::errc{} || end != text.data() + text.size())
    throw std::invalid_argument("its header has a bad number in 'shape'");
  return extent;
}

/// The header is a Python dictionary such as "{'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }",
/// which is nearly YAML.
Header parse_header(std::string text) {
  std::ranges::replace(text, '(', '[');
  std::ranges::replace(text, ')', ']');
  try {
    // The brackets make sure that text after the dictionary is not ignored.
    const YAML::Node list = YAML::Load("[" + text + "]");
    if (list.size() != 1 || list[0].size() != 3) throw YAML::Exception({}, "");
    Header header{list[0]["descr"].as<std::string>(), list[0]["fortran_order"].as<bool>(), {}};
    const YAML::Node shape = list[0]["shape"];
    if (!shape.IsSequence() || shape.size() > kMaxDimensions) throw YAML::Exception({}, "");
    for (const YAML::Node& extent : shape) header.shape.push_back(extent_of(extent.Scalar()));
    return header;
  } catch (const YAML::Exception&) {
    throw std::invalid_argument("its header is not one of numpy");
  }
}

Header read_header(std::istream& file) {
  if (read_exactly(file, kMagic.size()) != kMagic)
    throw std::invalid_argument("it does not start with \\x93NUMPY");
  const std::string version = read_exactly(file, 2);
  if (version[0] < 1 || version[0] > 3) throw std::invalid_argument("its format version is unknown");
  const std::string length_bytes = read_exactly(file, version[0] == 1 ? 2 : 4);
  std::size_t length = 0;
  for (std::size_t i = length_bytes.size(); i-- > 0;)
    length = length << 8 | static_cast<unsigned char>(length_bytes[i]);
  if (length > kLongestHeader) throw std::invalid_argument("its header is too long");
  return parse_header(read_exactly(file, length));
}

/// Checks that the file is as long as its header says, and the array not longer than `max_bytes`.
NpyArray read_array(std::istream& file, std::size_t max_bytes) {
  const Header header = read_header(file);
  const auto* known = std::ranges::find(kTypeNames, header.descr, &TypeName::descr);
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
std::string format_array(NpyType type, const std::vector<std::size_t>& shape, std::span<const T> values) {
  if (checked_size(shape, values.size()) != values.size())
    throw std::invalid_argument("write_npy: values do not fit the shape");
  std::string extents;
  for (const std::size_t extent : shape) extents += (extents.empty() ? "" : ", ") + std::to_string(extent);
  std::string header = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}{}), }}",
                                   name_of(type).descr, extents, shape.size() == 1 ? "," : "");
  const std::size_t prefix = kMagic.size() + 4;
  header.append(63 - (prefix + header.size()) % 64, ' ');  // The data are aligned to 64 bytes, as in numpy.
  header += '\n';
  std::string contents(kMagic);
  contents +=
      {'\x01', '\x00', static_cast<char>(header.size() & 0xff), static_cast<char>(header.size() >> 8)};
  contents += header;
  return contents.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

}  // namespace

std::size_t NpyArray::size() const { return data.size() / name_of(type).bytes; }

std::vector<double> NpyArray::to_doubles() const { return name_of(type).to_doubles(data); }

NpyArray read_npy(const std::filesystem::path& path, std::size_t max_bytes) {
  std::ifstream file = open_file(path);
  return read_named(file, max_bytes, path.string());
}

NpyArray parse_npy(std::string_view bytes, const std::string& name) {
  std::istringstream stream{std::string(bytes)};
  return read_named(stream, bytes.size(), name);
}

std::string format_npy(const std::vector<std::size_t>& shape, std::span<const double> values) {
  return format_array(NpyType::float64, shape, values);
}

void write_npy(const std::filesystem::path& path, const std::vector<std::size_t>& shape,
               std::span<const double> values) {
  write_file_atomically(path, format_npy(shape, values));
}
void write_npy(const std::filesystem::path& path, const std::vector<std::size_t>& shape,
               std::span<const float> values) {
  write_file_atomically(path, format_array(NpyType::float32, shape, values));
}

}  // namespace gelslam
