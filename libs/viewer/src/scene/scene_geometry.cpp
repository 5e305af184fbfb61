#include "scene/scene_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

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
void set_curvature_and_edge(DrawableMesh& out) {
  std::vector<float> sum(out.vertices_mm.size(), 0.0F), weight(out.vertices_mm.size(), 0.0F);
  double length_sum = 0;
  for (std::size_t i = 0; i < out.indices.size(); ++i) {
    const std::uint32_t a = out.indices[i], b = out.indices[i % 3 == 2 ? i - 2 : i + 1];
    const Vector3f along = out.vertices_mm[b] - out.vertices_mm[a];
    const float length2 = along.squaredNorm();
    length_sum += std::sqrt(length2);
    if (length2 < 1e-12F) continue;
    const float turn = (out.normals[b] - out.normals[a]).dot(along);  // curvature times length squared
    sum[a] += turn, sum[b] += turn;
    weight[a] += length2, weight[b] += length2;
  }
  out.curvature.reserve(sum.size());
  for (std::size_t i = 0; i < sum.size(); ++i) {
    out.curvature.push_back(weight[i] > 0 ? std::clamp(sum[i] / weight[i], -1e3F, 1e3F) : 0.0F);
  }
  out.edge_mm =
      out.indices.empty() ? 0 : static_cast<float>(length_sum / static_cast<double>(out.indices.size()));
}

void set_box(DrawableMesh& mesh) {
  mesh.box_mm.setEmpty();
  for (const Vector3f& vertex : mesh.vertices_mm) mesh.box_mm.extend(vertex);
}

/// The triangles `order[first..last)` of a mesh, with their vertices.
DrawableMesh piece_of(const DrawableMesh& mesh, const std::vector<std::uint32_t>& order, std::size_t first,
                      std::size_t last, std::vector<std::uint32_t>& new_index) {
  DrawableMesh piece;
  std::vector<std::uint32_t> taken;
  for (std::size_t i = first; i < last; ++i) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t old = mesh.indices[3 * static_cast<std::size_t>(order[i]) + corner];
      if (new_index[old] == kUnused) {
        new_index[old] = static_cast<std::uint32_t>(taken.size());
        taken.push_back(old);
      }
      piece.indices.push_back(new_index[old]);
    }
  }
  for (const std::uint32_t old : taken) {
    new_index[old] = kUnused;
    piece.vertices_mm.push_back(mesh.vertices_mm[old]);
    piece.normals.push_back(mesh.normals[old]);
    piece.confidence.push_back(mesh.confidence[old]);
    piece.curvature.push_back(mesh.curvature[old]);
    piece.source.push_back(mesh.source[old]);
  }
  piece.edge_mm = mesh.edge_mm;
  set_box(piece);
  return piece;
}

std::uint32_t signed_10_bits(float value) {
  return static_cast<std::uint32_t>(std::lround(value * 511.0F)) & 1023U;
}

}  // namespace

DrawableMesh make_drawable(const Mesh& mesh) {
  DrawableMesh out = keep_drawable(mesh);
  set_normals(out, mesh);
  set_confidence(out, mesh);
  set_curvature_and_edge(out);
  set_box(out);
  return out;
}

DrawableMesh make_drawable(const MeshBlock& block) {
  DrawableMesh out = make_drawable(block.mesh);
  if (block.keyframe.size() != block.mesh.vertices_mm.size()) return out;
  for (const std::uint32_t from : out.source) out.keyframe.push_back(block.keyframe[from]);
  return out;
}

std::vector<DrawableMesh> split(const DrawableMesh& mesh, std::size_t triangles_per_piece) {
  const std::size_t triangles = mesh.indices.size() / 3;
  if (triangles == 0) return {};
  // A surface of n triangles of edge e covers about n e^2 / 2; a cube of side s holds about s^2 of it.
  const float side = std::max({mesh.edge_mm * std::sqrt(0.5F * static_cast<float>(triangles_per_piece)),
                               1e-4F * mesh.box_mm.sizes().maxCoeff(), 1e-6F});
  std::vector<std::int64_t> cube(triangles);
  for (std::size_t t = 0; t < triangles; ++t) {
    const Vector3f p = (mesh.vertices_mm[mesh.indices[3 * t]] - mesh.box_mm.min()) / side;
    cube[t] = (static_cast<std::int64_t>(p.x()) << 40) + (static_cast<std::int64_t>(p.y()) << 20) +
              static_cast<std::int64_t>(p.z());
  }
  std::vector<std::uint32_t> order(triangles);
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return cube[a] < cube[b]; });
  std::vector<DrawableMesh> pieces;
  std::vector<std::uint32_t> new_index(mesh.vertices_mm.size(), kUnused);
  for (std::size_t first = 0; first < triangles;) {
    std::size_t last = first;
    while (last < triangles && cube[order[last]] == cube[order[first]]) ++last;
    pieces.push_back(piece_of(mesh, order, first, last, new_index));
    first = last;
  }
  return pieces;
}

std::vector<PackedVertex> pack(const DrawableMesh& mesh, const std::vector<float>& values) {
  std::vector<PackedVertex> packed(mesh.vertices_mm.size());
  for (std::size_t i = 0; i < packed.size(); ++i) {
    const Vector3f &p = mesh.vertices_mm[i], &n = mesh.normals[i];
    packed[i] = {{p.x(), p.y(), p.z()},
                 signed_10_bits(n.x()) | signed_10_bits(n.y()) << 10 | signed_10_bits(n.z()) << 20,
                 Eigen::half(mesh.curvature[i]).x,
                 Eigen::half(mesh.confidence[i]).x,
                 values.empty() ? kNoValue : values[i]};
  }
  return packed;
}

}  // namespace gelslam::viewer::detail
