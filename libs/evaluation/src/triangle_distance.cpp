#include "triangle_distance.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace gelslam::evaluation::detail {
namespace {

Eigen::Vector3d closest_on_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                   const Eigen::Vector3d& b) {
  const Eigen::Vector3d ab = b - a;
  const double length2 = ab.squaredNorm();
  if (length2 == 0.0) return a;
  return a + std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) * ab;
}

}  // namespace

Eigen::Vector3d closest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const double normal2 = normal.squaredNorm();
  if (normal2 > 0.0) {
    // Inside the prism above the triangle the foot of the perpendicular is nearest.
    const bool inside = normal.cross(b - a).dot(p - a) >= 0.0 && normal.cross(c - b).dot(p - b) >= 0.0 &&
                        normal.cross(a - c).dot(p - c) >= 0.0;
    if (inside) return p - (p - a).dot(normal) / normal2 * normal;
  }
  Eigen::Vector3d best = closest_on_segment(p, a, b);
  for (const Eigen::Vector3d& candidate : {closest_on_segment(p, b, c), closest_on_segment(p, c, a)}) {
    if ((candidate - p).squaredNorm() < (best - p).squaredNorm()) best = candidate;
  }
  return best;
}

}  // namespace gelslam::evaluation::detail
