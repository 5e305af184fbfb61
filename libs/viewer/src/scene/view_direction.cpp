#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "scene/scene_geometry.hpp"

namespace gelslam::viewer::detail {
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
  Vector3d lying = Eigen::SelfAdjointEigenSolver<Matrix3d>(spread).eigenvectors().col(2);
  lying -= lying.dot(outward) * outward;
  if (lying.x() < 0) lying = -lying;  // image x stays right
  const Vector3f back = outward.cast<float>();
  camera.look_along(-back, back.cross(lying.cast<float>()));
  const Viewport half_turn_high{0, 0, 1, 1};
  camera.orbit(Eigen::Vector2f(kTurnRad, kTiltRad) / std::numbers::pi_v<float>, half_turn_high);
}

}  // namespace gelslam::viewer::detail
