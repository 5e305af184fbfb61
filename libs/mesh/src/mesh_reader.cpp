#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "mesh_formats.hpp"

namespace gelslam {
namespace {

constexpr std::size_t kBeginningBytes = 512;

}  // namespace

Eigen::Vector3f mesh::detail::vertex_mm(const Eigen::Vector3d& vertex, double mm_per_unit) {
  constexpr double kMaxMm = 1e6;
  const Eigen::Vector3d mm = vertex * mm_per_unit;
  if (!mm.allFinite()) throw Error("it holds numbers that are not finite");
  if (mm.cwiseAbs().maxCoeff() > kMaxMm)
    throw Error("it holds a vertex more than 1 km from its origin; is its unit right?");
  return mm.cast<float>();
}

bool mesh::detail::is_text_stl(std::string_view bytes) {
  const std::string beginning = lower_case(std::string(bytes.substr(0, kBeginningBytes)));
  return beginning.find("solid") == beginning.find_first_not_of(" \t\r\n") &&
         beginning.find("facet") != std::string::npos;
}

namespace {

std::string beginning_of(const std::filesystem::path& path) {
  std::string beginning(kBeginningBytes, '\0');
  std::ifstream(path, std::ios::binary).read(beginning.data(), kBeginningBytes);
  return beginning;
}

/// The vertices have been checked by vertex_mm().
void check_readable(const Mesh& mesh) {
  if (mesh.vertices_mm.empty()) throw Error("it holds no vertices");
  if (mesh.triangles.empty()) throw Error("it holds no triangles");
  const int n = static_cast<int>(mesh.vertices_mm.size());
  const auto finite = [](const Eigen::Vector3f& v) { return std::isfinite(v.squaredNorm()); };
  if (!std::all_of(mesh.normals.begin(), mesh.normals.end(), finite))
    throw Error("it holds numbers that are not finite");
  const auto usable = [](float c) { return std::isfinite(c) && c >= 0; };
  if (!std::all_of(mesh.confidence.begin(), mesh.confidence.end(), usable))
    throw Error("it holds a confidence that is negative or not finite");
  for (const auto& t : mesh.triangles) {
    if (t.minCoeff() < 0 || t.maxCoeff() >= n) throw Error("a face of it names a vertex that does not exist");
  }
}

std::string lower_extension(const std::filesystem::path& path) {
  return lower_case(path.extension().string());
}

}  // namespace

bool is_mesh_name(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".ply" || extension == ".obj" || extension == ".stl";
}

const char* short_name(LengthUnit unit) { return unit == LengthUnit::meter ? "m" : "mm"; }

LengthUnit usual_unit(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  const bool in_mm = extension == ".obj" || extension == ".stl" || extension == ".xyz";
  return in_mm ? LengthUnit::millimeter : LengthUnit::meter;
}

std::optional<LengthUnit> noted_unit(const std::filesystem::path& path) {
  const std::string beginning = beginning_of(path);
  if (beginning.find("unit millimetre") != std::string::npos) return LengthUnit::millimeter;
  if (beginning.find("unit metre") != std::string::npos) return LengthUnit::meter;
  return std::nullopt;
}

LengthUnit unit_of(const std::filesystem::path& path) { return noted_unit(path).value_or(usual_unit(path)); }

std::optional<double> named_unit_mm(const std::filesystem::path& path, const std::string& unit) {
  static const std::map<std::string, double> millimeters = {{"mm", 1}, {"cm", 10}, {"in", 25.4}, {"m", 1000}};
  if (unit.empty()) return std::nullopt;
  const auto found = millimeters.find(unit);
  if (found == millimeters.end()) throw Error("there is no unit '" + unit + "'; use mm, cm, in or m");
  if (!std::filesystem::is_regular_file(path) || noted_unit(path)) return std::nullopt;
  return found->second;
}

std::uintmax_t bytes_behind_mesh(const std::filesystem::path& path) {
  constexpr std::uintmax_t header_bytes = 84, triangle_bytes = 50;
  std::error_code code;
  const std::uintmax_t size = std::filesystem::file_size(path, code);
  const std::string beginning = beginning_of(path);
  if (code || lower_extension(path) != ".stl" || mesh::detail::is_text_stl(beginning)) return 0;
  std::uint32_t triangles = 0;
  std::memcpy(&triangles, beginning.data() + 80, sizeof triangles);
  const std::uintmax_t whole = header_bytes + triangle_bytes * triangles;
  return triangles > 0 && size > whole ? size - whole : 0;
}

Mesh read_mesh(const std::filesystem::path& path, std::optional<double> mm_per_unit) {
  const std::string extension = lower_extension(path);
  if (!is_mesh_name(path))
    throw Error("cannot read mesh '" + path.string() +
                "': the name has to end in .ply, .obj or .stl (GLB is written only)");
  refuse_lfs_pointer(path);
  try {
    if (!std::filesystem::exists(path)) throw Error("there is no such file");
    if (!std::filesystem::is_regular_file(path)) throw Error("it is not a regular file");
    const double factor = mm_per_unit.value_or(unit_of(path) == LengthUnit::meter ? 1000.0 : 1.0);
    Mesh mesh = extension == ".ply" ? mesh::detail::read_ply(path, factor)
                                    : mesh::detail::read_with_assimp(path, extension, factor);
    check_readable(mesh);
    return mesh;
  } catch (const Error& e) {
    throw Error("cannot read mesh '" + path.string() + "': " + e.what());
  }
}

}  // namespace gelslam
