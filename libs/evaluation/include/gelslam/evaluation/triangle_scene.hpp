#pragma once

#include <memory>
#include <vector>

#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

struct ClosestPoint {
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();
  double distance_mm = 0.0;
  int triangle = -1;  ///< the lowest index among equally near ones
};

/// A triangle mesh made ready for distance and ray queries (Embree). Coordinates in millimeters, in the
/// mesh's frame. Queries may run in parallel and do not depend on the number of threads.
class TriangleScene {
 public:
  /// Keeps a copy. Throws Error as check_measurable().
  explicit TriangleScene(Mesh mesh);
  ~TriangleScene();

  /// On all cores. Throws Error for a mesh that covers itself thousands of times: every search would look at
  /// all of it.
  std::vector<ClosestPoint> closest(const std::vector<Eigen::Vector3d>& points_mm) const;

  /// The triangle that is hit first within `length_mm` along the unit `direction`, or -1.
  int first_hit(const Eigen::Vector3d& origin_mm, const Eigen::Vector3d& direction, double length_mm) const;

  const Mesh& mesh() const;
  /// Unit normal by the corners' order, or zero for a triangle without area.
  Eigen::Vector3d triangle_normal(int triangle) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
