#include "gelslam/surface/contact_overlap.hpp"

namespace gelslam {

ContactExtent extent_of(const std::vector<Eigen::Vector3d>& points_mm) {
  ContactExtent extent;
  for (const Eigen::Vector3d& p : points_mm) extent.center_mm += p / static_cast<double>(points_mm.size());
  for (const Eigen::Vector3d& p : points_mm)
    extent.radius_mm = std::max(extent.radius_mm, (p - extent.center_mm).norm());
  return extent;
}

bool may_overlap(const ContactExtent& a, const ContactExtent& b, const Pose& a_T_b) {
  constexpr double kMinFacing = 0.3;  // cosine between the directions of two touches
  return a_T_b.linear()(2, 2) >= kMinFacing &&
         (a_T_b * b.center_mm - a.center_mm).norm() < a.radius_mm + b.radius_mm;
}

}  // namespace gelslam
