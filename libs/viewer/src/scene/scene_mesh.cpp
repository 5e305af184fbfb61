#include "scene/scene_mesh.hpp"

#include <Eigen/LU>
#include <cmath>

#include "gelslam/core/index.hpp"
#include "gelslam/core/median.hpp"
#include "scene/scene_geometry.hpp"

namespace gelslam::viewer::detail {
namespace {

using Eigen::Vector3f;

/// Returns the distance along the ray to the triangle, hit from either side; NaN or negative if it is missed.
float hit_distance(const PickRay& ray, const Vector3f& a, const Vector3f& b, const Vector3f& c) {
  Eigen::Matrix3f edges;
  edges << b - a, c - a, -ray.direction;
  const Vector3f share = edges.inverse() * (ray.origin_mm - a);
  return share.x() >= 0 && share.y() >= 0 && share.x() + share.y() <= 1 ? share.z() : -1;
}

}  // namespace

void SceneMesh::put(std::int64_t key, const Mesh& mesh, const std::vector<float>& values) {
  blocks_.erase(key);
  if (mesh.triangles.empty()) return;
  Block& block = blocks_[key];
  block.mesh = mesh;
  for (const Vector3f& vertex : mesh.vertices_mm) block.box_mm.extend(vertex);
  block.confidence_p95 = quantile(mesh.confidence, 0.95);
  const std::vector<PackedVertex> vertices = pack(mesh, values);
  std::vector<float> bend;
  for (const PackedVertex& vertex : vertices) bend.push_back(std::abs(static_cast<float>(vertex.curvature)));
  block.curvature_p80 = quantile_in_place(bend, 0.8);
  block.drawn.set(vertices, mesh.triangles);
}

Eigen::AlignedBox3f SceneMesh::box_mm() const {
  Eigen::AlignedBox3f box;
  for (const auto& [key, block] : blocks_) box.extend(block.box_mm);
  return box;
}

float SceneMesh::confidence_p95() const {
  std::vector<float> of_blocks;
  for (const auto& [key, block] : blocks_) of_blocks.push_back(block.confidence_p95);
  return quantile_in_place(of_blocks, 0.95);
}

float SceneMesh::typical_curvature() const {
  std::vector<float> of_blocks;
  for (const auto& [key, block] : blocks_) of_blocks.push_back(block.curvature_p80);
  return quantile_in_place(of_blocks, 0.5);
}

std::optional<Vector3f> SceneMesh::pick(const PickRay& ray) const {
  std::optional<float> nearest;
  for (const auto& [key, block] : blocks_) {
    const auto at = [&](int vertex) { return block.mesh.vertices_mm[index(vertex)]; };
    for (const Eigen::Vector3i& t : block.mesh.triangles) {
      const float distance = hit_distance(ray, at(t[0]), at(t[1]), at(t[2]));
      if (distance > 0 && (!nearest || distance < *nearest)) nearest = distance;
    }
  }
  if (!nearest) return std::nullopt;
  return ray.origin_mm + *nearest * ray.direction;
}

void SceneMesh::draw() const {
  for (const auto& [key, block] : blocks_) block.drawn.draw();
}

}  // namespace gelslam::viewer::detail
