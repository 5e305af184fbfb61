#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// Returns the share of a contact's points (coarse_contact_points_mm()) that lie in another contact, a
/// Surface or a ContactRelief; 0 where there are none.
template <typename Contact>
double shown_share(const std::vector<Eigen::Vector3d>& points_mm, const Contact& other,
                   const Pose& other_T_points) {
  const auto shown = std::count_if(points_mm.begin(), points_mm.end(), [&](const Eigen::Vector3d& point) {
    return shows(other, other_T_points * point);
  });
  return points_mm.empty() ? 0.0 : static_cast<double>(shown) / static_cast<double>(points_mm.size());
}

/// A sphere around the points of a contact.
struct ContactExtent {
  Eigen::Vector3d center_mm = Eigen::Vector3d::Zero();
  double radius_mm = 0;
};

ContactExtent extent_of(const std::vector<Eigen::Vector3d>& points_mm);

/// Says whether two contacts can share anything: their spheres meet and both are seen from the same side.
bool may_overlap(const ContactExtent& a, const ContactExtent& b, const Pose& a_T_b);

/// Holds what shows() needs of a surface, in little memory: where its contact lies and how high, in cells of
/// several pixels, each by the pixel in its middle; heights are rounded as PackedSurface rounds them.
class ContactRelief {
 public:
  explicit ContactRelief(const Surface& surface, int cell_px);

  friend bool shows(const ContactRelief& relief, const Eigen::Vector3d& point_mm);

 private:
  CameraModel camera_;
  cv::Rect box_;                   ///< of the contact
  cv::Mat_<std::int16_t> height_;  ///< in the box
};

bool shows(const ContactRelief& relief, const Eigen::Vector3d& point_mm);

}  // namespace gelslam
