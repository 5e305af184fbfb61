#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// What shows() needs of a surface, in little memory: where its contact lies and how high, in cells of
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
