#include "scene/scene_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>
#include <utility>

#include "gelslam/core/median.hpp"

namespace gelslam::viewer::detail {
namespace {

using Eigen::AlignedBox3f;
using Eigen::Matrix4f;
using Eigen::Vector3f;
using Eigen::Vector4f;

/// Whether all of a box is outside one of the view's planes (Gribb & Hartmann: rows of the matrix).
bool is_outside(const Matrix4f& clip_T_map, const AlignedBox3f& box) {
  const Vector3f middle = box.center(), half = 0.5F * box.sizes();
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {1.0F, -1.0F}) {
      const Vector4f plane = clip_T_map.row(3).transpose() + sign * clip_T_map.row(axis).transpose();
      const float reach = plane.head<3>().cwiseAbs().dot(half);
      if (plane.head<3>().dot(middle) + plane.w() + reach < 0) return true;
    }
  }
  return false;
}

/// Distance along the ray to the triangle, or nothing (Möller & Trumbore 1997; both sides).
std::optional<float> hit_distance(const PickRay& ray, const Vector3f& a, const Vector3f& b,
                                  const Vector3f& c) {
  const Vector3f ab = b - a, ac = c - a, p = ray.direction.cross(ac), from_a = ray.origin_mm - a;
  const float determinant = ab.dot(p);
  if (determinant == 0) return std::nullopt;
  const float u = from_a.dot(p) / determinant;
  const Vector3f q = from_a.cross(ab);
  const float v = ray.direction.dot(q) / determinant, t = ac.dot(q) / determinant;
  if (!(u >= 0 && v >= 0 && u + v <= 1 && t > 0)) return std::nullopt;
  return t;
}

bool may_hit(const PickRay& ray, const AlignedBox3f& box) {
  float nearest = 0, furthest = std::numeric_limits<float>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const float speed = ray.direction[axis] != 0 ? ray.direction[axis] : 1e-30F;
    const float t0 = (box.min()[axis] - ray.origin_mm[axis]) / speed,
                t1 = (box.max()[axis] - ray.origin_mm[axis]) / speed;
    nearest = std::max(nearest, std::min(t0, t1)), furthest = std::min(furthest, std::max(t0, t1));
  }
  return nearest <= furthest;
}

}  // namespace

void SceneMesh::put(std::int64_t key, DrawableMesh mesh) {
  box_is_old_ = curvature_is_old_ = true;
  blocks_.erase(key);
  if (mesh.indices.empty()) return;
  Block& block = blocks_[key];
  block.mesh = std::move(mesh);
  block.confidence_p95 = quantile(block.mesh.confidence, 0.95);
  has_confidence_ |= block.confidence_p95 > 0;
  std::vector<float> bend = block.mesh.curvature;
  for (float& curvature : bend) curvature = std::abs(curvature);
  block.curvature_p80 = quantile_in_place(bend, 0.8);
  glBindVertexArray(block.vertex_array.name());
  upload(GL_ARRAY_BUFFER, block.vertices, pack(block.mesh), GL_STATIC_DRAW);
  set_attribute<PackedVertex>(0, 3, offsetof(PackedVertex, position_mm));
  set_attribute<PackedVertex>(1, 4, offsetof(PackedVertex, normal), GL_INT_2_10_10_10_REV);
  set_attribute<PackedVertex>(2, 2, offsetof(PackedVertex, curvature), GL_HALF_FLOAT);
  set_attribute<PackedVertex>(3, 1, offsetof(PackedVertex, value));
  upload(GL_ELEMENT_ARRAY_BUFFER, block.indices, block.mesh.indices, GL_STATIC_DRAW);
  glBindVertexArray(0);
}

void SceneMesh::clear() {
  blocks_.clear();
  has_confidence_ = false;
  box_is_old_ = curvature_is_old_ = true;
}

const AlignedBox3f& SceneMesh::box_mm() const {
  if (box_is_old_) {
    box_mm_.setEmpty();
    for (const auto& [key, block] : blocks_) box_mm_.extend(block.mesh.box_mm);
    box_is_old_ = false;
  }
  return box_mm_;
}

float SceneMesh::confidence_p95() const {
  std::vector<float> of_blocks;
  for (const auto& [key, block] : blocks_) of_blocks.push_back(block.confidence_p95);
  return quantile_in_place(of_blocks, 0.95);
}

float SceneMesh::typical_curvature() const {
  if (curvature_is_old_) {
    std::vector<float> of_blocks;
    for (const auto& [key, block] : blocks_) of_blocks.push_back(block.curvature_p80);
    typical_curvature_ = quantile_in_place(of_blocks, 0.5);
    curvature_is_old_ = false;
  }
  return typical_curvature_;
}

std::optional<Vector3f> SceneMesh::pick(const PickRay& ray) const {
  std::optional<float> nearest;
  for (const auto& [key, block] : blocks_) {
    if (!may_hit(ray, block.mesh.box_mm)) continue;
    const auto& [v, i] = std::tie(block.mesh.vertices_mm, block.mesh.indices);
    for (std::size_t t = 0; t + 2 < i.size(); t += 3) {
      const auto distance = hit_distance(ray, v[i[t]], v[i[t + 1]], v[i[t + 2]]);
      if (distance && (!nearest || *distance < *nearest)) nearest = distance;
    }
  }
  if (!nearest) return std::nullopt;
  return ray.origin_mm + *nearest * ray.direction;
}

void SceneMesh::draw(const Matrix4f& clip_T_map) const {
  for (const auto& [key, block] : blocks_) {
    if (is_outside(clip_T_map, block.mesh.box_mm)) continue;
    glBindVertexArray(block.vertex_array.name());
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(block.mesh.indices.size()), GL_UNSIGNED_INT, nullptr);
  }
  glBindVertexArray(0);
}

}  // namespace gelslam::viewer::detail
