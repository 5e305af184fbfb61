#include "open3d_reader.hpp"

#include <open3d/geometry/TriangleMesh.h>
#include <open3d/io/TriangleMeshIO.h>
#include <open3d/utility/Logging.h>

#include <exception>

#include "gelslam/core/error.hpp"

namespace gelslam::mesh::detail {
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

}  // namespace

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

}  // namespace gelslam::mesh::detail
