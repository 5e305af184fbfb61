#include "scene/scene_geometry.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include "gelslam/core/median.hpp"

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
        !mesh.vertices_mm[static_cast<std::size_t>(corner)].allFinite())
      return false;
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

float round_limit_mm(std::vector<float> distance_mm) {
  std::erase_if(distance_mm, [](float d) { return !std::isfinite(d) || d < 0; });
  if (distance_mm.empty()) return 1;
  const float wanted = std::max(quantile_in_place(distance_mm, 0.98), 1e-4F);
  const float power = std::pow(10.0F, std::floor(std::log10(wanted)));
  for (const float step : {1.0F, 2.0F, 5.0F})
    if (step * power >= wanted) return step * power;
  return 10 * power;
}

cv::Mat4b doubt_by_keyframe(const MapSnapshot& map, double from_mm, double to_mm) {
  const int last = map.nodes.empty() ? 0 : map.nodes.back().keyframe;
  cv::Mat4b doubt(1 + last / kDoubtColumns, kDoubtColumns, cv::Vec4b(0, 0, 0, 255));
  double sigma_mm = 0;  // of a keyframe that is not known yet: that of the one before
  for (const MapSnapshot::Node& node : map.nodes) {
    if (node.component != map.shown_component) continue;
    if (node.sigma_mm >= 0) sigma_mm = node.sigma_mm;
    doubt(node.keyframe / kDoubtColumns, node.keyframe % kDoubtColumns)[0] =
        cv::saturate_cast<uchar>(255 * (2 * sigma_mm - from_mm) / (to_mm - from_mm));
  }
  return doubt;
}

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kDirections = 200;
constexpr std::size_t kMaxTriangles = 20000;
constexpr float kTurnRad = 0.22F, kTiltRad = 0.28F;

/// Normals times area, and moments of the area, of some thousand triangles.
struct Area {
  double total_mm2 = 0;
  std::vector<Vector3d> normals;
  Vector3d place = Vector3d::Zero();
  Matrix3d spread = Matrix3d::Zero();
};

Area sample_area(const Mesh& mesh) {
  Area area;
  const auto count = static_cast<int>(mesh.vertices_mm.size());
  const std::size_t step = 1 + mesh.triangles.size() / kMaxTriangles;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += step) {
    const Eigen::Vector3i& t = mesh.triangles[i];
    if (t.minCoeff() < 0 || t.maxCoeff() >= count) continue;
    const auto corner = [&](int k) -> Vector3d {
      return mesh.vertices_mm[static_cast<std::size_t>(t[k])].cast<double>();
    };
    const Vector3d normal = 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0));
    const Vector3d middle = (corner(0) + corner(1) + corner(2)) / 3;
    if (!normal.allFinite() || !(middle.norm() < 1e6)) continue;
    area.total_mm2 += normal.norm();
    area.normals.push_back(normal);
    area.place += normal.norm() * middle;
    area.spread += normal.norm() * middle * middle.transpose();
  }
  return area;
}

/// The one of evenly spread directions from which most of the outside is seen; of near ones that of the first
/// touch.
Vector3d broadest_side(const Area& area) {
  Vector3d best = -Vector3d::UnitZ();
  double most_mm2 = 0;
  for (int i = 0; i < kDirections; ++i) {
    const double z = -1 + 2.0 * i / (kDirections - 1), around = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const Vector3d direction(std::sqrt(1 - z * z) * std::cos(around), std::sqrt(1 - z * z) * std::sin(around),
                             z);
    double seen_mm2 = -0.02 * z * area.total_mm2;
    for (const Vector3d& normal : area.normals) seen_mm2 += std::max(0.0, normal.dot(direction));
    if (seen_mm2 > most_mm2) most_mm2 = seen_mm2, best = direction;
  }
  return best;
}

}  // namespace

void look_at_broad_side(const Mesh& mesh, OrbitCamera& camera) {
  const Area area = sample_area(mesh);
  if (!(area.total_mm2 > 0)) return;
  const Vector3d outward = broadest_side(area), center = area.place / area.total_mm2;
  const Matrix3d spread = area.spread / area.total_mm2 - center * center.transpose();
  Vector3d lying = symmetric_eigen(spread).vectors.col(2);
  lying -= lying.dot(outward) * outward;
  if (lying.x() < 0) lying = -lying;  // image x stays right
  const Vector3f back = outward.cast<float>();
  camera.look_along(-back, back.cross(lying.cast<float>()));
  const Viewport half_turn_high{0, 0, 1, 1};
  camera.orbit(Eigen::Vector2f(kTurnRad, kTiltRad) / std::numbers::pi_v<float>, half_turn_high);
}

}  // namespace gelslam::viewer::detail
