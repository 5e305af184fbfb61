#pragma once

#include <memory>
#include <vector>

#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

/// Vertices further from the origin are refused: beyond it single precision no longer tells near triangles
/// apart, and a wrong unit is the likely reason.
inline constexpr double kFurthestVertexMm = 10e3;

struct ClosestPoint {
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();
  double distance_mm = 0.0;
  int triangle = -1;  ///< the lowest index among equally near ones
};

struct RayHit {
  double distance_mm = 0.0;
  int triangle = -1;
};

/// A triangle mesh made ready for distance and ray queries (Embree). Coordinates in millimeters, in the
/// mesh's frame. Queries may run in parallel and do not depend on the number of threads.
class TriangleScene {
 public:
  /// Keeps a copy. Throws Error when the mesh has no triangle, an index out of range, or a vertex that is not
  /// finite or too far away.
  explicit TriangleScene(Mesh mesh);
  ~TriangleScene();
  TriangleScene(TriangleScene&&) noexcept;
  TriangleScene& operator=(TriangleScene&&) noexcept;

  ClosestPoint closest(const Eigen::Vector3d& point_mm) const;
  /// The same for many points, on all cores. Throws Error for a mesh that covers itself thousands of times:
  /// every search would look at all of it.
  std::vector<ClosestPoint> closest(const std::vector<Eigen::Vector3d>& points_mm) const;

  /// All hits within `length_mm` along the unit `direction`, in no particular order.
  std::vector<RayHit> cast_all(const Eigen::Vector3d& origin_mm, const Eigen::Vector3d& direction,
                               double length_mm) const;

  const Mesh& mesh() const;
  /// Unit normal by the corners' order, or zero for a triangle without area.
  Eigen::Vector3d triangle_normal(int triangle) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
