#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "gelslam/loop_closure/loop_closer.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam::loop_closure::detail {

constexpr int kDescriptorSize = 128;

/// SIFT features of one curvature map. OpenCV's descriptors are whole numbers 0..255, kept as 16 bits because
/// the dot product is taken in those.
struct PlaceFeatures {
  std::vector<Eigen::Vector2f> pixels;
  std::vector<std::int16_t> descriptors;  ///< size() x kDescriptorSize

  int size() const { return static_cast<int>(pixels.size()); }
  const std::int16_t* descriptor(int i) const {
    return descriptors.data() + static_cast<std::size_t>(i) * kDescriptorSize;
  }
};

PlaceFeatures extract_features(const Surface& surface, const LoopClosureOptions& options);

}  // namespace gelslam::loop_closure::detail
