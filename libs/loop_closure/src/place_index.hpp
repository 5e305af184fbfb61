#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "place_features.hpp"

namespace gelslam::loop_closure::detail {

/// Index over the features of many keyframes that finds those which resemble a new one. Each descriptor of
/// the new keyframe votes for the keyframes that contain its nearest neighbors; the vote is the logarithm of
/// how much nearer they are than the best keyframe that gets no vote (local naive Bayes nearest neighbor,
/// McCann & Lowe 2012). Neighbors are found by the signs of random projections (locality-sensitive hashing,
/// Charikar 2002), so that the cost of a query grows with the number of similar descriptors, and not with the
/// number of all descriptors. Deterministic (fixed seed).
class PlaceIndex {
 public:
  PlaceIndex();

  /// Keyframes are numbered 0, 1, 2 ... in the order they are added.
  void add(PlaceFeatures features);
  const PlaceFeatures& features(int keyframe) const { return features_[static_cast<std::size_t>(keyframe)]; }

  /// Returns the `count` keyframes with most votes among the first `searched` ones, those with most votes
  /// first. Among equal ones the older comes first.
  std::vector<int> most_alike(const PlaceFeatures& features, int searched, int count) const;

 private:
  static constexpr int kTables = 8;
  static constexpr int kBits = 14;  // Fourteen bits give 16384 buckets per table.
  static constexpr int kProjections = kTables * kBits;
  using Projected = std::array<float, kProjections>;

  void project(const std::uint8_t* descriptor, Projected& result) const;
  /// Returns the bucket whose number has the signs of kBits projections as its bits.
  static std::uint32_t bucket_of(const float* projected);

  /// Calls see(keyframe, squared distance) for the descriptors in the same bucket of each table, and for
  /// those in the bucket that differs in the bit of the projection nearest to zero.
  template <typename See>
  void for_neighbors(const std::uint8_t* descriptor, See see) const;

  std::vector<float> projections_;                             // kDescriptorSize rows of kProjections
  std::array<std::vector<std::vector<int>>, kTables> tables_;  // Descriptor numbers by table and bucket.
  std::vector<PlaceFeatures> features_;                        // Features by keyframe.
  std::vector<int> keyframe_of_, number_of_;  // By descriptor number: its keyframe, and its index there.
};

}  // namespace gelslam::loop_closure::detail
