#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "place_features.hpp"

namespace gelslam::loop_closure::detail {

/// Which of many keyframes share features with one: every descriptor is hashed by the signs of random
/// projections into several tables, and keyframes in the same buckets get votes (locality-sensitive hashing,
/// Charikar 2002). The cost of a query grows with the number of look-alike descriptors, not with all of them.
/// Deterministic (explicit seed).
class PlaceIndex {
 public:
  PlaceIndex();

  /// Keyframes are numbered 0, 1, 2 ... in the order they are added.
  void add(const PlaceFeatures& features);

  /// Forgets all keyframes but the first `count`.
  void truncate(int count);

  /// The `count` keyframes with most votes among the first `searched`, best first; ties to the older.
  std::vector<int> most_alike(const PlaceFeatures& features, int searched, int count) const;

 private:
  static constexpr int kTables = 8;
  static constexpr int kBits = 14;

  std::array<float, kTables * kBits> project(const std::int16_t* descriptor) const;

  std::vector<float> projections_;  // kTables * kBits rows of kDescriptorSize
  std::array<std::vector<std::vector<int>>, kTables>
      tables_;                      // bucket -> keyframes, one entry per descriptor
  std::vector<int> feature_count_;  // of a keyframe
};

}  // namespace gelslam::loop_closure::detail
