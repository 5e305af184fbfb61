#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <unordered_map>
#include <vector>

#include "gelslam/viewer/orbit_camera.hpp"
#include "gl/gl_objects.hpp"
#include "scene/scene_geometry.hpp"

namespace gelslam::viewer::detail {

/// The numbers that a block's vertices are colored by.
using VertexValues = std::function<std::vector<float>(const DrawableMesh&)>;

/// Blocks of surface on the GPU.
class SceneMesh {
 public:
  void put(std::int64_t key, DrawableMesh mesh);  ///< without triangles: removes
  void clear();
  /// Blocks get their new values bit by bit, as they are drawn. Until then they keep the old ones, or, when
  /// those mean something else, count as blocks without. `of_keyframes`: ids of keyframes, which blocks that
  /// know them show at once.
  void set_values(VertexValues values, bool of_keyframes);

  /// Chooses the blocks in view. Spends about `budget_ms` on their values that are missing.
  void prepare(const Eigen::Matrix4f& clip_T_map, double budget_ms);
  /// Draws the blocks that were chosen, those with values or those without, with the program of the mesh in
  /// use.
  void draw(bool with_values);

  const Eigen::AlignedBox3f& box_mm() const;
  std::optional<Eigen::Vector3f> pick(const PickRay& ray) const;
  float confidence_p95() const;
  bool has_confidence() const { return has_confidence_; }
  float typical_curvature() const;  ///< what four of five vertices stay below, 1/mm
  /// About `count` vertices, evenly from all blocks.
  std::vector<Eigen::Vector3f> sample_vertices(std::size_t count) const;
  std::size_t triangle_count() const { return triangles_; }
  std::size_t drawn_triangles() const { return drawn_triangles_; }
  bool is_complete() const { return is_complete_; }

 private:
  struct Block {
    DrawableMesh mesh;
    GlVertexArray vertex_array;
    GlBuffer vertices, indices;
    std::uint64_t values_version = 0, values_meaning = 0;
    float confidence_p95 = 0, curvature_p80 = 0;
  };

  void make_values(double budget_ms);
  bool has_values(const Block& block) const;

  std::unordered_map<std::int64_t, Block> blocks_;
  std::size_t triangles_ = 0, drawn_triangles_ = 0;
  VertexValues values_;
  bool of_keyframes_ = false;  // values_
  std::uint64_t values_version_ = 0, values_meaning_ = 0;
  bool is_complete_ = true, has_confidence_ = false;
  mutable Eigen::AlignedBox3f box_mm_;
  mutable bool box_is_old_ = false, curvature_is_old_ = false;
  mutable float typical_curvature_ = 0;
  std::vector<Block*> seen_;  // chosen by prepare()
};

}  // namespace gelslam::viewer::detail
