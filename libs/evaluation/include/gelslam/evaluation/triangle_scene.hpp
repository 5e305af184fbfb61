#pragma once

#include <memory>
#include <vector>

#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

struct ClosestPoint {
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();
  double distance_mm = 0.0;
  int triangle = -1;  ///< The lowest index among equally near triangles.
};

/// A triangle mesh prepared for distance and ray queries (Embree). Coordinates are in millimeters in the
/// mesh's frame. Queries may run in parallel; their results do not depend on the number of threads.
class TriangleScene {
 public:
  /// Stores a copy of the mesh. Throws Error as check_measurable().
  explicit TriangleScene(Mesh mesh);
  ~TriangleScene();

  /// Returns the closest point of the mesh for each point, computed on all cores. Throws Error for a mesh
  /// with thousands of triangles at the same place, for which every search would visit all of them.
  std::vector<ClosestPoint> closest(const std::vector<Eigen::Vector3d>& points_mm) const;

  /// Returns the triangle that is hit first within `length_mm` along the unit vector `direction`, or -1.
  int first_hit(const Eigen::Vector3d& origin_mm, const Eigen::Vector3d& direction, double length_mm) const;

  const Mesh& mesh() const;
  /// Returns the unit normal by the order of the corners, or zero for a triangle without area.
  Eigen::Vector3d triangle_normal(int triangle) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
