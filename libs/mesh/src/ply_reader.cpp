#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "mesh_formats.hpp"

namespace gelslam::mesh::detail {
namespace {

constexpr std::size_t kMaxHeaderBytes = 64 * 1024;
constexpr std::size_t kMaxElements = 16;
constexpr std::size_t kMaxProperties = 64;

template <typename T>
double take(const char* at, bool reversed) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), at, sizeof(T));
  if (reversed) std::reverse(raw.begin(), raw.end());
  return static_cast<double>(std::bit_cast<T>(raw));
}

struct Type {
  std::string_view name, other_name;
  std::size_t bytes;
  double (*take)(const char* at, bool reversed);
};
constexpr Type kTypes[] = {
    {"char", "int8", 1, take<std::int8_t>},    {"uchar", "uint8", 1, take<std::uint8_t>},
    {"short", "int16", 2, take<std::int16_t>}, {"ushort", "uint16", 2, take<std::uint16_t>},
    {"int", "int32", 4, take<std::int32_t>},   {"uint", "uint32", 4, take<std::uint32_t>},
    {"float", "float32", 4, take<float>},      {"double", "float64", 8, take<double>}};

enum class Format { ascii, little_endian, big_endian };
constexpr std::array<std::string_view, 3> kFormats{"ascii", "binary_little_endian", "binary_big_endian"};

struct Property {
  std::string name;
  const Type* type = nullptr;
  const Type* count_type = nullptr;  ///< Type of a list's length.
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Format format = Format::ascii;
  std::vector<Element> elements;
  std::size_t size_bytes = 0;
};

const Type* parse_type(const std::string& name) {
  for (const Type& type : kTypes)
    if (name == type.name || name == type.other_name) return &type;
  throw Error("the PLY header names an unknown type '" + name.substr(0, 40) + "'");
}

void parse_property(std::istringstream& words, Element& element) {
  if (element.properties.size() >= kMaxProperties) throw Error("the PLY header has too many properties");
  Property property;
  std::string type;
  words >> type;
  if (type == "list") {
    std::string count_type;
    words >> count_type >> type;
    property.count_type = parse_type(count_type);
  }
  property.type = parse_type(type);
  if (!(words >> property.name)) throw Error("the PLY header has a property without a name");
  element.properties.push_back(std::move(property));
}

Format parse_format(std::istringstream& words) {
  std::string format;
  words >> format;
  const auto found = std::ranges::find(kFormats, format);
  if (found == kFormats.end())
    throw Error("the PLY header names an unknown format '" + format.substr(0, 40) + "'");
  return static_cast<Format>(found - kFormats.begin());
}

Header parse_header(std::string_view bytes) {
  const std::string_view head = bytes.substr(0, kMaxHeaderBytes);
  Header header;
  std::optional<Format> format;
  std::size_t at = 0;
  for (int line_number = 0;; ++line_number) {
    const std::size_t newline = head.find('\n', at);
    if (newline == std::string_view::npos) throw Error("the PLY header does not end");
    std::string line(head.substr(at, newline - at));
    if (!line.empty() && line.back() == '\r') line.pop_back();
    at = newline + 1;
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    if (line_number == 0) {
      if (line != "ply") throw Error("it does not begin with 'ply'");
    } else if (keyword == "format") {
      format = parse_format(words);
    } else if (keyword == "element") {
      Element element;
      if (!(words >> element.name >> element.count))
        throw Error("the PLY header has an element without a count");
      if (header.elements.size() >= kMaxElements) throw Error("the PLY header has too many elements");
      header.elements.push_back(std::move(element));
    } else if (keyword == "property") {
      if (header.elements.empty()) throw Error("the PLY header has a property before any element");
      parse_property(words, header.elements.back());
    } else if (keyword == "end_header") {
      break;
    } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info") {
      throw Error("the PLY header has an unknown line '" + keyword.substr(0, 40) + "'");
    }
  }
  if (!format) throw Error("the PLY header names no format");
  header.format = *format;
  header.size_bytes = at;
  return header;
}

/// Reads the body of the file, one scalar after another.
class Cursor {
 public:
  Cursor(std::string_view body, Format format)
      : at_(body.data()), end_(body.data() + body.size()), format_(format) {}

  std::size_t remaining() const { return static_cast<std::size_t>(end_ - at_); }
  /// Returns the least number of bytes that a scalar of this type can take.
  std::size_t min_size(const Type& type) const { return format_ == Format::ascii ? 1 : type.bytes; }

  double scalar(const Type& type) { return format_ == Format::ascii ? ascii() : binary(type); }

  std::size_t count(const Type& type) {
    const double value = scalar(type);
    if (!(value >= 0) || value > static_cast<double>(remaining()))
      throw Error("a list in it is longer than the file");
    return static_cast<std::size_t>(value);
  }

 private:
  double ascii() {
    while (at_ != end_ && (*at_ == ' ' || *at_ == '\n' || *at_ == '\r' || *at_ == '\t')) ++at_;
    if (at_ == end_) throw Error("it ends too early");
    double value = 0;
    const auto [next, error] = std::from_chars(at_, end_, value);
    if (error != std::errc{}) throw Error("it holds something that is not a number");
    at_ = next;
    return value;
  }

  double binary(const Type& type) {
    if (remaining() < type.bytes) throw Error("it ends too early");
    const bool file_is_little = format_ == Format::little_endian;
    const char* const begin = std::exchange(at_, at_ + type.bytes);
    return type.take(begin, file_is_little != (std::endian::native == std::endian::little));
  }

  const char* at_;
  const char* end_;
  Format format_;
};

void check_count(const Element& element, const Cursor& cursor) {
  std::size_t least_bytes = 0;
  for (const Property& p : element.properties)
    least_bytes += cursor.min_size(*(p.count_type ? p.count_type : p.type));
  if (least_bytes == 0 && element.count > 0)
    throw Error("its element '" + element.name.substr(0, 40) + "' is empty");
  if (element.count > 0 && element.count > cursor.remaining() / least_bytes)
    throw Error("it is too short for its " + std::to_string(element.count) + " elements '" +
                element.name.substr(0, 40) + "'");
  if (element.count > static_cast<std::uint64_t>(std::numeric_limits<int>::max()))
    throw Error("it is too large");
}

void skip(const Property& property, Cursor& cursor) {
  const std::size_t n = property.count_type ? cursor.count(*property.count_type) : 1;
  for (std::size_t i = 0; i < n; ++i) cursor.scalar(*property.type);
}

constexpr std::array<std::string_view, 7> kVertexSlots{"x", "y", "z", "nx", "ny", "nz", "confidence"};

void read_vertices(const Element& element, double mm_per_unit, Cursor& cursor, Mesh& mesh) {
  std::vector<int> slot_of_property;
  std::array<bool, kVertexSlots.size()> has{};
  for (const Property& p : element.properties) {
    const auto found = std::find(kVertexSlots.begin(), kVertexSlots.end(), p.name);
    const bool used = found != kVertexSlots.end() && !p.count_type;
    slot_of_property.push_back(used ? static_cast<int>(found - kVertexSlots.begin()) : -1);
    if (used) has[static_cast<std::size_t>(slot_of_property.back())] = true;
  }
  if (!has[0] || !has[1] || !has[2]) throw Error("its vertices have no x y z");
  const bool has_normals = has[3] && has[4] && has[5];
  const std::size_t n = static_cast<std::size_t>(element.count);
  mesh.vertices_mm.reserve(n);
  if (has_normals) mesh.normals.reserve(n);
  if (has[6]) mesh.confidence.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    std::array<double, kVertexSlots.size()> value{};
    for (std::size_t k = 0; k < slot_of_property.size(); ++k)
      if (slot_of_property[k] < 0)
        skip(element.properties[k], cursor);
      else
        value[static_cast<std::size_t>(slot_of_property[k])] = cursor.scalar(*element.properties[k].type);
    mesh.vertices_mm.push_back(vertex_mm({value[0], value[1], value[2]}, mm_per_unit));
    if (has_normals) mesh.normals.push_back(Eigen::Vector3d(value[3], value[4], value[5]).cast<float>());
    if (has[6]) mesh.confidence.push_back(static_cast<float>(value[6]));
  }
}

int to_index(double value) {
  if (!(value >= 0 && value <= std::numeric_limits<int>::max()) || value != std::floor(value))
    throw Error("a face of it names a vertex that does not exist");
  return static_cast<int>(value);
}

/// Returns false if the face is not a triangle.
bool read_face(const Property& property, Cursor& cursor, Mesh& mesh) {
  const std::size_t corners = cursor.count(*property.count_type);
  if (corners < 3) throw Error("a face of it is no polygon");
  std::array<int, 3> face{};
  for (std::size_t c = 0; c < corners; ++c)
    face[std::min<std::size_t>(c, 2)] = to_index(cursor.scalar(*property.type));
  mesh.triangles.emplace_back(face[0], face[1], face[2]);
  return corners == 3;
}

/// Each vertex from the third on makes a triangle; -1 begins a new strip.
void read_strip(const Property& property, Cursor& cursor, Mesh& mesh) {
  std::vector<int> strip;
  for (std::size_t left = cursor.count(*property.count_type); left > 0; --left) {
    const double value = cursor.scalar(*property.type);
    if (value == -1) {
      strip.clear();
      continue;
    }
    strip.push_back(to_index(value));
    const std::size_t n = strip.size();
    const bool turned = n % 2 == 0;
    if (n > 2)
      mesh.triangles.emplace_back(strip[turned ? n - 2 : n - 3], strip[turned ? n - 3 : n - 2], strip[n - 1]);
  }
}

/// Returns false if some faces are not triangles.
bool read_faces(const Element& element, Cursor& cursor, Mesh& mesh) {
  bool triangles = true;
  mesh.triangles.reserve(static_cast<std::size_t>(element.count));
  for (std::uint64_t i = 0; i < element.count; ++i) {
    for (const Property& p : element.properties)
      if (!p.count_type || (p.name != "vertex_indices" && p.name != "vertex_index"))
        skip(p, cursor);
      else if (element.name == "tristrips")
        read_strip(p, cursor, mesh);
      else
        triangles = read_face(p, cursor, mesh) && triangles;
  }
  return triangles;
}

}  // namespace

Mesh read_ply(const std::filesystem::path& path, double mm_per_unit) {
  const std::string bytes = read_file(path);
  const Header header = parse_header(bytes);
  Cursor cursor(std::string_view(bytes).substr(header.size_bytes), header.format);
  Mesh mesh;
  bool triangles = true;
  for (const Element& element : header.elements) {
    check_count(element, cursor);
    if (element.name == "vertex") {
      if (!mesh.vertices_mm.empty()) throw Error("it has two lists of vertices");
      read_vertices(element, mm_per_unit, cursor, mesh);
    } else if (element.name == "face" || element.name == "tristrips") {
      triangles = read_faces(element, cursor, mesh) && triangles;
    } else {
      for (std::uint64_t i = 0; i < element.count; ++i)
        for (const Property& p : element.properties) skip(p, cursor);
    }
  }
  return triangles ? mesh : read_with_assimp(path, ".ply", mm_per_unit);
}

}  // namespace gelslam::mesh::detail
