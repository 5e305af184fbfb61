#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// Returns the fraction of the points of a contact (from coarse_contact_points_mm()) that another contact
/// shows, which is given as a Surface or a ContactRelief. Returns 0 if there are no points.
template <typename Contact>
double shown_share(const std::vector<Eigen::Vector3d>& points_mm, const Contact& other,
                   const Pose& other_T_points) {
  const auto shown = std::count_if(points_mm.begin(), points_mm.end(), [&](const Eigen::Vector3d& point) {
    return shows(other, other_T_points * point);
  });
  return points_mm.empty() ? 0.0 : static_cast<double>(shown) / static_cast<double>(points_mm.size());
}

/// A sphere that contains the points of a contact.
struct ContactExtent {
  Eigen::Vector3d center_mm = Eigen::Vector3d::Zero();
  double radius_mm = 0;
};

ContactExtent extent_of(const std::vector<Eigen::Vector3d>& points_mm);

/// Returns false if two contacts cannot overlap, because their spheres do not intersect or they were touched
/// from different sides.
bool may_overlap(const ContactExtent& a, const ContactExtent& b, const Pose& a_T_b);

/// The contact and the heights of a surface at a lower resolution, so that shows() can be evaluated without
/// the surface. Each cell of `cell_px` pixels side length has the values of the pixel in its middle. Heights
/// are rounded as in PackedSurface.
class ContactRelief {
 public:
  explicit ContactRelief(const Surface& surface, int cell_px);

  friend bool shows(const ContactRelief& relief, const Eigen::Vector3d& point_mm);

 private:
  CameraModel camera_;
  cv::Rect box_;                   ///< the bounding box of the contact, in cells
  cv::Mat_<std::int16_t> height_;  ///< the heights in the box, in multiples of PackedSurface::kHeightStepMm
};

/// Returns the same as shows() of the surface, at the lower resolution.
bool shows(const ContactRelief& relief, const Eigen::Vector3d& point_mm);

}  // namespace gelslam
