#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "gelslam/mesh/mesh.hpp"
#include "gelslam/viewer/orbit_camera.hpp"
#include "gl/gl_objects.hpp"

namespace gelslam::viewer::detail {

/// Blocks of surface on the GPU.
class SceneMesh {
 public:
  /// `values` as in pack(). A mesh without triangles removes the block.
  void put(std::int64_t key, const Mesh& mesh, const std::vector<float>& values);
  void clear() { blocks_.clear(); }
  void draw() const;  ///< The current program must be that of the mesh.

  Eigen::AlignedBox3f box_mm() const;
  std::optional<Eigen::Vector3f> pick(const PickRay& ray) const;
  float confidence_p95() const;
  float typical_curvature() const;  ///< The 80 % quantile over the vertices, 1/mm.

 private:
  struct Block {
    Mesh mesh;
    GlTriangles drawn;
    Eigen::AlignedBox3f box_mm;
    float confidence_p95 = 0, curvature_p80 = 0;
  };

  std::unordered_map<std::int64_t, Block> blocks_;
};

}  // namespace gelslam::viewer::detail
