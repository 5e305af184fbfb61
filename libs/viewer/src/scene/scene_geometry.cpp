#include "scene/scene_geometry.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "gelslam/core/index.hpp"
#include "gelslam/core/median.hpp"
#include "gl/gl_objects.hpp"

namespace gelslam::viewer::detail {
namespace {

using Eigen::Vector3f;
using Eigen::Vector3i;

/// Returns unit normals. Missing ones are the sum of the normals of the triangles around the vertex, weighted
/// by area.
std::vector<Vector3f> unit_normals(const Mesh& mesh) {
  std::vector<Vector3f> normals = mesh.normals;
  normals.resize(mesh.vertices_mm.size(), Vector3f::Zero());
  std::vector<Vector3f> made(normals.size(), Vector3f::Zero());
  for (const Vector3i& t : mesh.triangles) {
    const Vector3f& a = mesh.vertices_mm[index(t[0])];
    const Vector3f normal = (mesh.vertices_mm[index(t[1])] - a).cross(mesh.vertices_mm[index(t[2])] - a);
    for (const int corner : t) made[index(corner)] += normal;
  }
  for (std::size_t i = 0; i < normals.size(); ++i) {
    if (normals[i].isZero(0)) normals[i] = made[i];
    if (normals[i].isZero(0)) normals[i] = Vector3f::UnitZ();
    normals[i].stableNormalize();
  }
  return normals;
}

/// Returns the mean curvature in 1/mm, positive on ridges: along each edge it is the rotation of the normal
/// over the edge's length, and these are averaged around each vertex.
std::vector<float> curvature_of(const Mesh& mesh, const std::vector<Vector3f>& normals) {
  std::vector<float> sum(normals.size(), 0.0F), weight(normals.size(), 0.0F);
  for (const Vector3i& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) {
      const std::size_t a = index(t[i]), b = index(t[(i + 1) % 3]);
      const Vector3f along = mesh.vertices_mm[b] - mesh.vertices_mm[a];
      const float length2 = along.squaredNorm();
      if (length2 < 1e-12F) continue;
      const float turn = (normals[b] - normals[a]).dot(along);  // Curvature times the squared length.
      sum[a] += turn, sum[b] += turn;
      weight[a] += length2, weight[b] += length2;
    }
  for (std::size_t i = 0; i < sum.size(); ++i)
    sum[i] = weight[i] > 0 ? std::clamp(sum[i] / weight[i], -1e3F, 1e3F) : 0.0F;
  return sum;
}

std::uint32_t signed_10_bits(float value) {
  return static_cast<std::uint32_t>(std::lround(value * 511.0F)) & 1023U;
}

}  // namespace

std::vector<PackedVertex> pack(const Mesh& mesh, const std::vector<float>& values) {
  constexpr float kMaxConfidence = 6e4F;  // Limit of a half float.
  const std::vector<Vector3f> normals = unit_normals(mesh);
  const std::vector<float> curvature = curvature_of(mesh, normals);
  std::vector<PackedVertex> packed(normals.size());
  for (std::size_t i = 0; i < packed.size(); ++i) {
    const Vector3f& n = normals[i];
    packed[i] = {mesh.vertices_mm[i],
                 signed_10_bits(n.x()) | signed_10_bits(n.y()) << 10 | signed_10_bits(n.z()) << 20,
                 Eigen::half(curvature[i]),
                 Eigen::half(mesh.confidence.empty() ? 0 : std::min(mesh.confidence[i], kMaxConfidence)),
                 values.empty() ? kNoValue : values[i]};
  }
  return packed;
}

void PackedVertex::set_attributes() {
  set_attribute<PackedVertex>(0, 3, offsetof(PackedVertex, position_mm));
  set_attribute<PackedVertex>(1, 4, offsetof(PackedVertex, normal), GL_INT_2_10_10_10_REV);
  set_attribute<PackedVertex>(2, 2, offsetof(PackedVertex, curvature), GL_HALF_FLOAT);
  set_attribute<PackedVertex>(3, 1, offsetof(PackedVertex, value));
}

float round_limit_mm(const std::vector<float>& distance_mm) {
  if (distance_mm.empty()) return 1;
  const float wanted = std::max(quantile(distance_mm, 0.98), 1e-4F);
  const float power = std::pow(10.0F, std::floor(std::log10(wanted)));
  for (const float step : {1.0F, 2.0F, 5.0F})
    if (step * power >= wanted) return step * power;
  return 10 * power;
}

cv::Mat4b uncertainty_by_keyframe(const MapSnapshot& map, double from_mm, double to_mm) {
  const int last = map.nodes.empty() ? 0 : map.nodes.back().keyframe;
  cv::Mat4b uncertainty(1 + last / kUncertaintyColumns, kUncertaintyColumns, cv::Vec4b(0, 0, 0, 255));
  for (const MapSnapshot::Node& node : map.nodes) {
    if (node.component != map.shown_component) continue;
    const double sigma_mm = map.pose_of({.keyframe = node.keyframe})->map_T_frame.worst_sigma_mm();
    uncertainty(node.keyframe / kUncertaintyColumns, node.keyframe % kUncertaintyColumns)[0] =
        cv::saturate_cast<uchar>(255 * (2 * sigma_mm - from_mm) / (to_mm - from_mm));
  }
  return uncertainty;
}

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kDirections = 200;
constexpr std::size_t kMaxTriangles = 20000;
constexpr float kTurnRad = 0.22F, kTiltRad = 0.28F;

/// Area-weighted normals, and moments of the area, of at most kMaxTriangles triangles.
struct Area {
  double total_mm2 = 0;
  std::vector<Vector3d> normals;
  Vector3d place = Vector3d::Zero();
  Matrix3d spread = Matrix3d::Zero();
};

Area sample_area(const Mesh& mesh) {
  Area area;
  const std::size_t step = 1 + mesh.triangles.size() / kMaxTriangles;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += step) {
    const Eigen::Vector3i& t = mesh.triangles[i];
    const auto corner = [&](int k) -> Vector3d { return mesh.vertices_mm[index(t[k])].cast<double>(); };
    const Vector3d normal = 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0));
    const Vector3d middle = (corner(0) + corner(1) + corner(2)) / 3;
    area.total_mm2 += normal.norm();
    area.normals.push_back(normal);
    area.place += normal.norm() * middle;
    area.spread += normal.norm() * middle * middle.transpose();
  }
  return area;
}

/// Returns the direction, of kDirections evenly spread ones, along which the largest area of the surface
/// faces the viewer; occlusion is ignored. Among similar ones it prefers that of the first touch.
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
  if (lying.x() < 0) lying = -lying;  // The x axis of the map points to the right.
  const Vector3f back = outward.cast<float>();
  camera.look_along(-back, back.cross(lying.cast<float>()));
  const Viewport half_turn_high{0, 0, 1, 1};
  camera.orbit(Eigen::Vector2f(kTurnRad, kTiltRad) / std::numbers::pi_v<float>, half_turn_high);
}

}  // namespace gelslam::viewer::detail
