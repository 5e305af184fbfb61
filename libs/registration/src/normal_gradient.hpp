#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::registration::detail {

/// Change of the normal per pixel along x and y (Sobel). `p` is no border pixel.
struct NormalGradient {
  cv::Vec3f dx, dy;
};

inline NormalGradient normal_gradient(const cv::Mat3f& normals, cv::Point p) {
  const cv::Vec3f *above = &normals(p.y - 1, p.x), *here = &normals(p), *below = &normals(p.y + 1, p.x);
  return {(above[1] - above[-1] + 2.0f * (here[1] - here[-1]) + below[1] - below[-1]) * 0.125f,
          (below[-1] - above[-1] + 2.0f * (below[0] - above[0]) + below[1] - above[1]) * 0.125f};
}

}  // namespace gelslam::registration::detail
