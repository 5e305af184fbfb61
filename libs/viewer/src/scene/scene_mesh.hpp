#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>

#include "gelslam/viewer/orbit_camera.hpp"
#include "gl/gl_objects.hpp"
#include "scene/scene_geometry.hpp"

namespace gelslam::viewer::detail {

/// Blocks of surface on the GPU.
class SceneMesh {
 public:
  void put(std::int64_t key, DrawableMesh mesh);  ///< without triangles: removes
  void clear();
  /// The blocks in view, with the program of the mesh in use.
  void draw(const Eigen::Matrix4f& clip_T_map) const;

  const Eigen::AlignedBox3f& box_mm() const;
  std::optional<Eigen::Vector3f> pick(const PickRay& ray) const;
  float confidence_p95() const;
  bool has_confidence() const { return has_confidence_; }
  float typical_curvature() const;  ///< what four of five vertices stay below, 1/mm

 private:
  struct Block {
    DrawableMesh mesh;
    GlVertexArray vertex_array;
    GlBuffer vertices, indices;
    float confidence_p95 = 0, curvature_p80 = 0;
  };

  std::unordered_map<std::int64_t, Block> blocks_;
  bool has_confidence_ = false;
  mutable Eigen::AlignedBox3f box_mm_;
  mutable bool box_is_old_ = false, curvature_is_old_ = false;
  mutable float typical_curvature_ = 0;
};

}  // namespace gelslam::viewer::detail
