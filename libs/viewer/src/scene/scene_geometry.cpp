#include "scene/scene_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gelslam::viewer::detail {
namespace {

using Eigen::Vector3f;
using Eigen::Vector3i;

constexpr float kFurthestMm = 1e6F;
constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();

bool is_drawable(const Mesh& mesh, const Vector3i& triangle) {
  for (const int corner : triangle) {
    if (corner < 0 || static_cast<std::size_t>(corner) >= mesh.vertices_mm.size()) return false;
    // not (a < b) on purpose: it holds for NaN too
    if (!(mesh.vertices_mm[static_cast<std::size_t>(corner)].cwiseAbs().maxCoeff() < kFurthestMm) ||
        !mesh.vertices_mm[static_cast<std::size_t>(corner)].allFinite()) {
      return false;
    }
  }
  return true;
}

/// Vertices and triangles that can be drawn, in their order.
DrawableMesh keep_drawable(const Mesh& mesh) {
  DrawableMesh out;
  std::vector<std::uint32_t> new_index(mesh.vertices_mm.size(), kUnused);
  out.indices.reserve(3 * mesh.triangles.size());
  for (const Vector3i& triangle : mesh.triangles) {
    if (!is_drawable(mesh, triangle)) continue;
    for (const int corner : triangle) {
      std::uint32_t& index = new_index[static_cast<std::size_t>(corner)];
      if (index == kUnused) {
        index = static_cast<std::uint32_t>(out.source.size());
        out.source.push_back(static_cast<std::uint32_t>(corner));
      }
      out.indices.push_back(index);
    }
  }
  for (const std::uint32_t from : out.source) out.vertices_mm.push_back(mesh.vertices_mm[from]);
  return out;
}

/// Sum of the normals of the triangles around each vertex, weighted by area.
std::vector<Vector3f> normals_of_triangles(const DrawableMesh& mesh) {
  std::vector<Vector3f> normals(mesh.vertices_mm.size(), Vector3f::Zero());
  for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3) {
    const Vector3f& a = mesh.vertices_mm[mesh.indices[t]];
    const Vector3f normal =
        (mesh.vertices_mm[mesh.indices[t + 1]] - a).cross(mesh.vertices_mm[mesh.indices[t + 2]] - a);
    for (std::size_t corner = 0; corner < 3; ++corner) normals[mesh.indices[t + corner]] += normal;
  }
  return normals;
}

bool has_direction(const Vector3f& v) {
  const float length = v.norm();
  return std::isfinite(length) && length > 0;
}

void set_normals(DrawableMesh& out, const Mesh& mesh) {
  const bool given = mesh.normals.size() == mesh.vertices_mm.size();
  std::vector<Vector3f> made;
  out.normals.reserve(out.source.size());
  for (std::size_t i = 0; i < out.source.size(); ++i) {
    Vector3f normal = given ? mesh.normals[out.source[i]] : Vector3f::Zero();
    if (!has_direction(normal)) {
      if (made.empty()) made = normals_of_triangles(out);
      normal = has_direction(made[i]) ? made[i] : Vector3f::UnitZ();
    }
    out.normals.push_back(normal.stableNormalized());
  }
}

void set_confidence(DrawableMesh& out, const Mesh& mesh) {
  const bool given = mesh.confidence.size() == mesh.vertices_mm.size();
  for (const std::uint32_t from : out.source) {
    const float value = given ? mesh.confidence[from] : 0.0F;
    out.confidence.push_back(std::isfinite(value) ? std::clamp(value, 0.0F, 6e4F) : 0.0F);
  }
}

/// Curvature along each edge (own; the turn of the normal over the edge's length), averaged around the
/// vertex.
void set_curvature(DrawableMesh& out) {
  std::vector<float> sum(out.vertices_mm.size(), 0.0F), weight(out.vertices_mm.size(), 0.0F);
  for (std::size_t i = 0; i < out.indices.size(); ++i) {
    const std::uint32_t a = out.indices[i], b = out.indices[i % 3 == 2 ? i - 2 : i + 1];
    const Vector3f along = out.vertices_mm[b] - out.vertices_mm[a];
    const float length2 = along.squaredNorm();
    if (length2 < 1e-12F) continue;
    const float turn = (out.normals[b] - out.normals[a]).dot(along);  // curvature times length squared
    sum[a] += turn, sum[b] += turn;
    weight[a] += length2, weight[b] += length2;
  }
  out.curvature.reserve(sum.size());
  for (std::size_t i = 0; i < sum.size(); ++i)
    out.curvature.push_back(weight[i] > 0 ? std::clamp(sum[i] / weight[i], -1e3F, 1e3F) : 0.0F);
}

void set_values(DrawableMesh& out, const Mesh& mesh, const std::vector<float>& values) {
  const bool given = values.size() == mesh.vertices_mm.size();
  for (const std::uint32_t from : out.source)
    out.value.push_back(given && std::isfinite(values[from]) ? values[from] : kNoValue);
}

std::uint32_t signed_10_bits(float value) {
  return static_cast<std::uint32_t>(std::lround(value * 511.0F)) & 1023U;
}

}  // namespace

DrawableMesh make_drawable(const Mesh& mesh, const std::vector<float>& values) {
  DrawableMesh out = keep_drawable(mesh);
  set_normals(out, mesh);
  set_confidence(out, mesh);
  set_curvature(out);
  set_values(out, mesh, values);
  for (const Vector3f& vertex : out.vertices_mm) out.box_mm.extend(vertex);
  return out;
}

std::vector<PackedVertex> pack(const DrawableMesh& mesh) {
  std::vector<PackedVertex> packed(mesh.vertices_mm.size());
  for (std::size_t i = 0; i < packed.size(); ++i) {
    const Vector3f &p = mesh.vertices_mm[i], &n = mesh.normals[i];
    packed[i] = {{p.x(), p.y(), p.z()},
                 signed_10_bits(n.x()) | signed_10_bits(n.y()) << 10 | signed_10_bits(n.z()) << 20,
                 Eigen::half(mesh.curvature[i]).x,
                 Eigen::half(mesh.confidence[i]).x,
                 mesh.value[i]};
  }
  return packed;
}

}  // namespace gelslam::viewer::detail
