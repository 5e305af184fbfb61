#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// What shows() needs of a surface, in less than a tenth of its memory: where its contact lies and how high,
/// rounded as PackedSurface rounds heights. For a surface that was unpacked, shows() gives the same result.
/// With cells of several pixels, each by the pixel in its middle, it takes still less, and is coarser.
class ContactRelief {
 public:
  explicit ContactRelief(const Surface& surface, int cell_px = 1);

  friend bool shows(const ContactRelief& relief, const Eigen::Vector3d& point_mm);

 private:
  CameraModel camera_;
  cv::Rect box_;                   ///< of the contact
  cv::Mat_<std::int16_t> height_;  ///< in the box
};

bool shows(const ContactRelief& relief, const Eigen::Vector3d& point_mm);

}  // namespace gelslam
