#include <Eigen/Geometry>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/mesh/mesh_io.hpp"

namespace gelslam {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY and STL are written as they lie in memory");

template <typename T>
void append(std::string& out, T value) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), &value, sizeof(T));
  out.append(raw.data(), raw.size());
}

void append(std::string& out, const Eigen::Vector3f& v) {
  for (int i = 0; i < 3; ++i) append(out, v[i]);
}

/// Shortest decimal that reads back to the same float, whatever the locale.
void append_text(std::string& out, const Eigen::Vector3f& v) {
  for (int i = 0; i < 3; ++i) {
    std::array<char, 48> digits;
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), v[i]).ptr;
    out += ' ';
    out.append(digits.data(), end);
  }
}

Eigen::Vector3f in_file_unit(const Eigen::Vector3f& v_mm, double units_per_mm) {
  return (v_mm.cast<double>() * units_per_mm).cast<float>();
}

std::string encode_ply(const Mesh& mesh, double units_per_mm, const VertexColors& colors) {
  const bool normals = !mesh.normals.empty();
  const bool confidence = !mesh.confidence.empty();
  std::string out = "ply\nformat binary_little_endian 1.0\n";
  out += units_per_mm == 1.0 ? "comment unit millimetre\n" : "comment unit metre\n";
  out += "element vertex " + std::to_string(mesh.vertices_mm.size()) + "\n";
  out += "property float x\nproperty float y\nproperty float z\n";
  if (normals) out += "property float nx\nproperty float ny\nproperty float nz\n";
  if (confidence) out += "property float confidence\n";
  if (!colors.empty()) out += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  out += "element face " + std::to_string(mesh.triangles.size()) +
         "\nproperty list uchar int vertex_indices\nend_header\n";
  out.reserve(out.size() + mesh.vertices_mm.size() * 28 + mesh.triangles.size() * 13);
  for (std::size_t i = 0; i < mesh.vertices_mm.size(); ++i) {
    append(out, in_file_unit(mesh.vertices_mm[i], units_per_mm));
    if (normals) append(out, mesh.normals[i]);
    if (confidence) append(out, mesh.confidence[i]);
    if (!colors.empty())
      for (const std::uint8_t level : colors[i]) append(out, level);
  }
  for (const auto& t : mesh.triangles) {
    append(out, std::uint8_t{3});
    for (int c = 0; c < 3; ++c) append(out, static_cast<std::int32_t>(t[c]));
  }
  return out;
}

std::string encode_obj(const Mesh& mesh, double units_per_mm) {
  std::string out = units_per_mm == 1.0 ? "# unit millimetre\n" : "# unit metre\n";
  for (const auto& v : mesh.vertices_mm) {
    out += 'v';
    append_text(out, in_file_unit(v, units_per_mm));
    out += '\n';
  }
  for (const auto& n : mesh.normals) {
    out += "vn";
    append_text(out, n);
    out += '\n';
  }
  for (const auto& t : mesh.triangles) {
    out += 'f';
    for (int c = 0; c < 3; ++c) {
      const std::string index = std::to_string(t[c] + 1);
      out += ' ';
      out += index;
      if (!mesh.normals.empty()) out += "//" + index;
    }
    out += '\n';
  }
  return out;
}

std::string encode_stl(const Mesh& mesh, double units_per_mm) {
  std::string out = units_per_mm == 1.0 ? "unit millimetre" : "unit metre";
  out.resize(80, ' ');
  out.reserve(84 + mesh.triangles.size() * 50);
  append(out, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& t : mesh.triangles) {
    const auto corner = [&](int c) { return mesh.vertices_mm[static_cast<std::size_t>(t[c])]; };
    append(out, Eigen::Vector3f((corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized()));
    for (int c = 0; c < 3; ++c) append(out, in_file_unit(corner(c), units_per_mm));
    append(out, std::uint16_t{0});
  }
  return out;
}

void check_consistent(const Mesh& mesh, const VertexColors& colors, const std::filesystem::path& path) {
  const std::string failure = "cannot write mesh '" + path.string() + "': ";
  const std::size_t n = mesh.vertices_mm.size();
  if ((!mesh.normals.empty() && mesh.normals.size() != n) ||
      (!mesh.confidence.empty() && mesh.confidence.size() != n) || (!colors.empty() && colors.size() != n)) {
    throw Error(failure + "it has not as many normals, confidences or colors as vertices");
  }
  for (const auto& t : mesh.triangles) {
    if (t.minCoeff() < 0 || static_cast<std::size_t>(t.maxCoeff()) >= n) {
      throw Error(failure + "it has a triangle that names a vertex that does not exist");
    }
  }
}

}  // namespace

void write_mesh(const std::filesystem::path& path, const Mesh& mesh, LengthUnit file_unit,
                const VertexColors& colors) {
  const std::string extension = lower_case(path.extension().string());
  const double units_per_mm = file_unit == LengthUnit::meter ? 1e-3 : 1.0;
  const std::string failure = "cannot write mesh '" + path.string() + "': ";
  check_consistent(mesh, colors, path);
  if (!colors.empty() && (extension == ".obj" || extension == ".stl"))
    throw Error(failure + "OBJ and STL hold no colors; PLY and GLB do");
  if (extension == ".ply") {
    write_file_atomically(path, encode_ply(mesh, units_per_mm, colors));
  } else if (extension == ".obj") {
    write_file_atomically(path, encode_obj(mesh, units_per_mm));
  } else if (extension == ".stl") {
    write_file_atomically(path, encode_stl(mesh, units_per_mm));
  } else if (extension == ".glb") {
    if (file_unit != LengthUnit::meter) throw Error(failure + "glTF files are in meters");
    write_file_atomically(path, encode_glb(mesh, colors));
  } else {
    throw Error(failure + "the name has to end in .ply, .obj, .stl or .glb");
  }
}

}  // namespace gelslam
