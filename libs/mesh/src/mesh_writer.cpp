#include <fmt/core.h>

#include <bit>
#include <cstdint>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "mesh_formats.hpp"

namespace gelslam {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY is written as it lies in memory");

/// Appends the bytes of a number or of an array of numbers.
template <typename T>
void append(std::string& out, const T& value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

std::string unit_note(LengthUnit unit) {
  return unit == LengthUnit::millimeter ? "unit millimetre" : "unit metre";
}

void check_consistent(const Mesh& mesh, const VertexColors& colors) {
  const std::size_t n = mesh.vertices_mm.size();
  if ((!mesh.normals.empty() && mesh.normals.size() != n) ||
      (!mesh.confidence.empty() && mesh.confidence.size() != n) || (!colors.empty() && colors.size() != n))
    throw Error("it has not as many normals, confidences or colors as vertices");
  for (const auto& t : mesh.triangles)
    if (t.minCoeff() < 0 || static_cast<std::size_t>(t.maxCoeff()) >= n)
      throw Error("it has a triangle that names a vertex that does not exist");
}

std::string encode_ply(const Mesh& mesh, LengthUnit file_unit, const VertexColors& colors) {
  const bool normals = !mesh.normals.empty();
  const bool confidence = !mesh.confidence.empty();
  std::string out = "ply\nformat binary_little_endian 1.0\n";
  out += "comment " + unit_note(file_unit) + "\n";
  out += "element vertex " + std::to_string(mesh.vertices_mm.size()) + "\n";
  out += "property float x\nproperty float y\nproperty float z\n";
  if (normals) out += "property float nx\nproperty float ny\nproperty float nz\n";
  if (confidence) out += "property float confidence\n";
  if (!colors.empty()) out += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  out += "element face " + std::to_string(mesh.triangles.size()) +
         "\nproperty list uchar int vertex_indices\nend_header\n";
  out.reserve(out.size() + mesh.vertices_mm.size() * 28 + mesh.triangles.size() * 13);
  for (std::size_t i = 0; i < mesh.vertices_mm.size(); ++i) {
    append(out, mesh::detail::in_file_unit(mesh.vertices_mm[i], file_unit));
    if (normals) append(out, mesh.normals[i]);
    if (confidence) append(out, mesh.confidence[i]);
    if (!colors.empty()) append(out, colors[i]);
  }
  for (const auto& t : mesh.triangles) {
    append(out, std::uint8_t{3});
    append(out, t);
  }
  return out;
}

/// Writes one line per vertex: x y z nx ny nz.
std::string encode_points(const Mesh& mesh, LengthUnit file_unit) {
  std::string out;
  for (std::size_t i = 0; i < mesh.vertices_mm.size(); ++i) {
    const Eigen::Vector3f p = mesh::detail::in_file_unit(mesh.vertices_mm[i], file_unit);
    out += fmt::format("{:.7g} {:.7g} {:.7g}", p.x(), p.y(), p.z());
    if (!mesh.normals.empty())
      out +=
          fmt::format(" {:.5f} {:.5f} {:.5f}", mesh.normals[i].x(), mesh.normals[i].y(), mesh.normals[i].z());
    out += '\n';
  }
  return out;
}

}  // namespace

/// The unit is noted in an OBJ as a comment, in an STL in its header of 80 bytes.
std::string encode_mesh(const Mesh& mesh, const std::string& extension, LengthUnit file_unit,
                        const VertexColors& colors) {
  check_consistent(mesh, colors);
  if (extension == ".ply") return encode_ply(mesh, file_unit, colors);
  if (extension == ".xyz" && colors.empty()) return encode_points(mesh, file_unit);
  if (extension == ".glb") {
    if (file_unit != LengthUnit::meter) throw Error("glTF files are in meters");
    return mesh::detail::encode_with_assimp(mesh, extension, file_unit, colors);
  }
  if (!colors.empty()) throw Error("only PLY and GLB hold colors");
  if (extension != ".obj" && extension != ".stl")
    throw Error("the name has to end in .ply, .obj, .stl, .xyz or .glb");
  std::string bytes = mesh::detail::encode_with_assimp(mesh, extension, file_unit, colors);
  std::string note = unit_note(file_unit);
  if (extension == ".obj") return "# " + note + "\n" + bytes;
  note.resize(80, ' ');
  return bytes.replace(0, note.size(), note);
}

void write_mesh(const std::filesystem::path& path, const Mesh& mesh, LengthUnit file_unit,
                const VertexColors& colors) {
  std::string bytes;
  try {
    bytes = encode_mesh(mesh, lower_case(path.extension().string()), file_unit, colors);
  } catch (const Error& e) {
    throw Error("cannot write mesh '" + path.string() + "': " + e.what());
  }
  write_file_atomically(path, bytes);
}

}  // namespace gelslam
