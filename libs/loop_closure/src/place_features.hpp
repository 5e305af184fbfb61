#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/loop_closure/loop_closer.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam::loop_closure::detail {

constexpr int kDescriptorSize = 128;  // SIFT's 4x4 histograms of 8 directions.

/// SIFT features of one curvature map. OpenCV's descriptors are whole numbers 0..255.
struct PlaceFeatures {
  std::vector<Eigen::Vector2f> pixels;
  std::vector<std::uint8_t> descriptors;  ///< size() x kDescriptorSize

  int size() const { return static_cast<int>(pixels.size()); }
  const std::uint8_t* descriptor(int i) const {
    return descriptors.data() + static_cast<std::size_t>(i) * kDescriptorSize;
  }
};

PlaceFeatures extract_features(const Surface& surface, const LoopClosureOptions& options);

/// Computes the squared distances (L2) of one descriptor to `count` others, one after the other.
void squared_distances(const std::uint8_t* query, const std::uint8_t* others, int count, int* result);

struct Match {
  int a = 0, b = 0;  ///< feature indices
};

/// Returns the matches that are each other's nearest (L2) and clearly nearer than the second nearest in both
/// directions (Lowe 2004, `max_ratio` on distances): what looks like several places is no evidence for one.
std::vector<Match> match_features(const PlaceFeatures& a, const PlaceFeatures& b, double max_ratio);

/// Returns the matches (a = older, b = newer) that one rotation and shift in the image explains. Rigid, not
/// similar: the scale changes by a few per cent with depth at most, so a place has one. Same input, same
/// answer (explicit seed).
std::vector<Match> rigid_inliers(const PlaceFeatures& older, const PlaceFeatures& newer,
                                 const std::vector<Match>& matches, double threshold_px, int iterations);

/// Returns older_T_newer: the rotation and shift of the matches, with the tilt and shift along z that normals
/// and points tell there (coarse_pose).
Pose lift(const Surface& older, const Surface& newer, const PlaceFeatures& older_features,
          const PlaceFeatures& newer_features, const std::vector<Match>& matches);

}  // namespace gelslam::loop_closure::detail
