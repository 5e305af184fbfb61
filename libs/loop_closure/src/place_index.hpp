#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "place_features.hpp"

namespace gelslam::loop_closure::detail {

/// Finds which of many keyframes share features with one. Each descriptor votes for the keyframes that hold
/// its nearest neighbors, by how much nearer they are than the next ones (local naive Bayes nearest neighbor,
/// McCann & Lowe 2012). Neighbors are found by the signs of random projections (locality-sensitive hashing,
/// Charikar 2002), so that the cost of a query grows with the number of look-alike descriptors, not with all
/// of them. Deterministic (explicit seed).
class PlaceIndex {
 public:
  PlaceIndex();

  /// Keyframes are numbered 0, 1, 2 ... in the order they are added.
  void add(PlaceFeatures features);
  const PlaceFeatures& features(int keyframe) const { return features_[static_cast<std::size_t>(keyframe)]; }

  /// Returns the `count` keyframes with most votes among the first `searched`, best first; ties to the older.
  std::vector<int> most_alike(const PlaceFeatures& features, int searched, int count) const;

 private:
  static constexpr int kTables = 8;
  static constexpr int kBits = 14;  // Fourteen bits give 16384 buckets per table.
  static constexpr int kProjections = kTables * kBits;
  using Projected = std::array<float, kProjections>;

  void project(const std::uint8_t* descriptor, Projected& result) const;
  /// Returns the bucket that the signs of kBits projections name.
  static std::uint32_t bucket_of(const float* projected);

  /// Calls see(keyframe, squared distance) for descriptors in the same buckets, and in those beyond the least
  /// sure projection.
  template <typename See>
  void for_neighbors(const std::uint8_t* descriptor, See see) const;

  std::vector<float> projections_;                             // kDescriptorSize rows of kProjections
  std::array<std::vector<std::vector<int>>, kTables> tables_;  // bucket -> descriptors
  std::vector<PlaceFeatures> features_;                        // by keyframe
  std::vector<int> keyframe_of_, number_of_;                   // of a descriptor: where it is
};

}  // namespace gelslam::loop_closure::detail
