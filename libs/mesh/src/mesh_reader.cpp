#include <open3d/geometry/TriangleMesh.h>
#include <open3d/io/TriangleMeshIO.h>
#include <open3d/utility/Logging.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <fstream>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "ply_reader.hpp"

namespace gelslam {
namespace {

/// Open3D reports to the terminal by default; a library has to be silent.
class SilentOpen3d {
 public:
  SilentOpen3d() : before_(open3d::utility::GetVerbosityLevel()) {
    open3d::utility::SetVerbosityLevel(open3d::utility::VerbosityLevel::Error);
  }
  ~SilentOpen3d() { open3d::utility::SetVerbosityLevel(before_); }
  SilentOpen3d(const SilentOpen3d&) = delete;
  SilentOpen3d& operator=(const SilentOpen3d&) = delete;

 private:
  open3d::utility::VerbosityLevel before_;
};

/// OBJ and STL in all their dialects. Open3D's failures (a false return, an exception, or a mesh without
/// content) become one Error.
Mesh read_with_open3d(const std::filesystem::path& path, double mm_per_unit) {
  const SilentOpen3d silence;
  open3d::geometry::TriangleMesh source;
  bool ok = false;
  try {
    open3d::io::ReadTriangleMeshOptions options;
    ok = open3d::io::ReadTriangleMesh(path.string(), source, options);
  } catch (const std::exception&) {
    ok = false;  // its message names Open3D's own source lines: nothing a person can use
  }
  if (!ok) throw Error("it is damaged, or not a mesh of the kind its name says");
  source.RemoveDuplicatedVertices();  // STL repeats every vertex for every triangle
  Mesh mesh;
  mesh.vertices_mm.reserve(source.vertices_.size());
  for (const auto& v : source.vertices_) mesh.vertices_mm.push_back((v * mm_per_unit).cast<float>());
  if (source.vertex_normals_.size() == source.vertices_.size()) {
    mesh.normals.reserve(source.vertex_normals_.size());
    for (const auto& n : source.vertex_normals_) mesh.normals.push_back(n.cast<float>());
  }
  mesh.triangles = {source.triangles_.begin(), source.triangles_.end()};
  return mesh;
}

void check_readable(const Mesh& mesh) {
  if (mesh.vertices_mm.empty()) throw Error("it holds no vertices");
  if (mesh.triangles.empty()) throw Error("it holds no triangles");
  const int n = static_cast<int>(mesh.vertices_mm.size());
  const auto finite = [](const Eigen::Vector3f& v) { return v.allFinite(); };
  if (!std::all_of(mesh.vertices_mm.begin(), mesh.vertices_mm.end(), finite) ||
      !std::all_of(mesh.normals.begin(), mesh.normals.end(), finite)) {
    throw Error("it holds numbers that are not finite");
  }
  const auto usable = [](float c) { return std::isfinite(c) && c >= 0; };
  if (!std::all_of(mesh.confidence.begin(), mesh.confidence.end(), usable)) {
    throw Error("it holds a confidence that is negative or not finite");
  }
  for (const auto& t : mesh.triangles) {
    if (t.minCoeff() < 0 || t.maxCoeff() >= n) throw Error("a face of it names a vertex that does not exist");
  }
}

/// The unit that write_mesh() notes near the beginning of every file.
LengthUnit noted_unit(const std::filesystem::path& path) {
  constexpr std::size_t kBeginning_bytes = 512;
  std::string beginning(kBeginning_bytes, '\0');
  std::ifstream(path, std::ios::binary).read(beginning.data(), kBeginning_bytes);
  return beginning.find("unit millimetre") != std::string::npos ? LengthUnit::millimetre : LengthUnit::metre;
}

std::string lower_extension(const std::filesystem::path& path) {
  return lower_case(path.extension().string());
}

}  // namespace

const char* short_name(LengthUnit unit) { return unit == LengthUnit::metre ? "m" : "mm"; }

LengthUnit usual_unit(const std::filesystem::path& path) {
  return lower_extension(path) == ".ply" ? LengthUnit::metre : LengthUnit::millimetre;
}

Mesh read_mesh(const std::filesystem::path& path, std::optional<LengthUnit> file_unit) {
  const std::string extension = lower_extension(path);
  if (extension != ".ply" && extension != ".obj" && extension != ".stl") {
    throw Error("cannot read mesh '" + path.string() + "': the name has to end in .ply, .obj or .stl");
  }
  try {
    if (!std::filesystem::exists(path)) throw Error("there is no such file");
    if (!std::filesystem::is_regular_file(path)) throw Error("it is not a regular file");
    const LengthUnit unit = file_unit ? *file_unit : noted_unit(path);
    const double mm_per_unit = unit == LengthUnit::metre ? 1000.0 : 1.0;
    Mesh mesh =
        extension == ".ply" ? mesh::detail::read_ply(path, mm_per_unit) : read_with_open3d(path, mm_per_unit);
    check_readable(mesh);
    return mesh;
  } catch (const Error& e) {
    throw Error("cannot read mesh '" + path.string() + "': " + e.what());
  }
}

}  // namespace gelslam
