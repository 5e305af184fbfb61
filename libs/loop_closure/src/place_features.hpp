#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/loop_closure/loop_closer.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam::loop_closure::detail {

constexpr int kDescriptorSize = 128;  // SIFT has 4x4 histograms with 8 directions each.

/// SIFT features of one curvature map. OpenCV's descriptors are whole numbers from 0 to 255.
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

/// Returns the pairs of features that are each other's nearest neighbor (L2) and pass the ratio test in both
/// directions (Lowe 2004; `max_ratio` applies to distances, not to their squares). A feature that looks like
/// several others is no evidence for any of them.
std::vector<Match> match_features(const PlaceFeatures& a, const PlaceFeatures& b, double max_ratio);

/// A rotation and a shift in the image that map pixels of one surface to pixels of another.
struct RigidMotion {
  Eigen::Matrix2f rotation = Eigen::Matrix2f::Identity();
  Eigen::Vector2f shift = Eigen::Vector2f::Zero();
  int inliers = 0;  ///< Number of matches within the threshold.

  Eigen::Vector2f operator*(const Eigen::Vector2f& p) const { return rotation * p + shift; }
};

/// Returns the older_T_newer (in pixels) with most inliers among the matches, where a = older and b = newer.
/// The motion is rigid and has no scale, because depth changes the scale of a place by a few per cent at
/// most. Deterministic: the random generator has a fixed seed. Returns no inliers for fewer than two matches.
RigidMotion align_rigidly(const PlaceFeatures& older, const PlaceFeatures& newer,
                          const std::vector<Match>& matches, double threshold_px, int iterations);

/// Returns older_T_newer in 3-D (mm): rotation and shift in the plane from the match in the image; tilt and
/// shift along z from the normals and points of the two contacts where they then overlap (coarse_pose()).
Pose lift(const Surface& older, const Surface& newer, const RigidMotion& older_T_newer);

}  // namespace gelslam::loop_closure::detail
