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

/// A rotation and a shift in the image: pixels of one surface to pixels of another.
struct RigidMotion {
  Eigen::Matrix2f rotation = Eigen::Matrix2f::Identity();
  Eigen::Vector2f shift = Eigen::Vector2f::Zero();
  int inliers = 0;  ///< the matches that it explains

  Eigen::Vector2f operator*(const Eigen::Vector2f& p) const { return rotation * p + shift; }
};

/// Returns the older_T_newer that explains most matches (a = older, b = newer). Rigid, not similar: the scale
/// changes by a few per cent with depth at most, so a place has one. Same input, same answer (explicit seed).
RigidMotion align_rigidly(const PlaceFeatures& older, const PlaceFeatures& newer,
                          const std::vector<Match>& matches, double threshold_px, int iterations);

/// Returns older_T_newer in space: the motion in the image with the tilt and the shift along z that normals
/// and points tell there (coarse_pose).
Pose lift(const Surface& older, const Surface& newer, const RigidMotion& older_T_newer);

}  // namespace gelslam::loop_closure::detail
