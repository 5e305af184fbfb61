// An index from descriptors to keyframes: local naive Bayes nearest neighbors (McCann & Lowe 2012) with
// locality-sensitive hashing (Charikar 2002).
//
// Each of kTables hash tables assigns a descriptor to one of 2^kBits buckets by the signs of kBits random
// projections. A query looks into its own bucket of each table and into the one beyond the projection nearest
// to zero. For each descriptor of the query, let d_j be the squared distance to the nearest descriptor of
// keyframe j, and D that of the first keyframe after the `count` nearest ones. Keyframe j then gets the vote
// log(D / d_j).

#include "place_index.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <utility>

#include "gelslam/core/target_clones.hpp"

namespace gelslam::loop_closure::detail {

PlaceIndex::PlaceIndex() {
  std::mt19937_64 random;  // The default seed gives the same projections on every machine.
  projections_.resize(static_cast<std::size_t>(kDescriptorSize * kProjections));
  for (int projection = 0; projection < kProjections; ++projection) {
    std::array<float, kDescriptorSize> weights;
    for (float& weight : weights) {
      // The sum of 8 random bytes is close to normally distributed and, unlike std::normal_distribution, the
      // same on every machine.
      int sum = 0;
      for (std::uint64_t bytes = random(), k = 0; k < 8; ++k, bytes >>= 8)
        sum += static_cast<int>(bytes & 255U);
      weight = static_cast<float>(sum) - 8.0F * 127.5F;
    }
    // Descriptors have no negative entries. Weights that sum to zero respond to a descriptor's shape and not
    // to its mean.
    const float mean = std::accumulate(weights.begin(), weights.end(), 0.0F) / kDescriptorSize;
    for (std::size_t k = 0; k < weights.size(); ++k)
      projections_[k * kProjections + static_cast<std::size_t>(projection)] = weights[k] - mean;
  }
  for (auto& table : tables_) table.resize(std::size_t{1} << kBits);
}

GELSLAM_CLONES void PlaceIndex::project(const std::uint8_t* descriptor, Projected& result) const {
  result.fill(0);
  const float* weight = projections_.data();
  for (int k = 0; k < kDescriptorSize; ++k, weight += kProjections) {
    const auto value = static_cast<float>(descriptor[k]);
    for (int p = 0; p < kProjections; ++p) result[static_cast<std::size_t>(p)] += weight[p] * value;
  }
}

std::uint32_t PlaceIndex::bucket_of(const float* projected) {
  std::uint32_t bucket = 0;
  for (int bit = 0; bit < kBits; ++bit) bucket |= static_cast<std::uint32_t>(projected[bit] > 0) << bit;
  return bucket;
}

template <typename See>
void PlaceIndex::for_neighbors(const std::uint8_t* descriptor, See see) const {
  Projected projected;
  project(descriptor, projected);
  for (int table = 0; table < kTables; ++table) {
    const float* values = projected.data() + table * kBits;
    const auto least_sure =
        std::min_element(values, values + kBits, [](float a, float b) { return std::abs(a) < std::abs(b); }) -
        values;
    const std::uint32_t bucket = bucket_of(values);
    for (const std::uint32_t probe : {bucket, bucket ^ (1U << least_sure)})
      for (const int i : tables_[static_cast<std::size_t>(table)][probe]) {
        const int keyframe = keyframe_of_[static_cast<std::size_t>(i)];
        int distance = 0;
        squared_distances(descriptor, features(keyframe).descriptor(number_of_[static_cast<std::size_t>(i)]),
                          1, &distance);
        see(keyframe, distance);
      }
  }
}

void PlaceIndex::add(PlaceFeatures features) {
  Projected projected;
  for (int i = 0; i < features.size(); ++i) {
    project(features.descriptor(i), projected);
    for (int table = 0; table < kTables; ++table)
      tables_[static_cast<std::size_t>(table)][bucket_of(projected.data() + table * kBits)].push_back(
          static_cast<int>(keyframe_of_.size()));
    keyframe_of_.push_back(static_cast<int>(features_.size()));
    number_of_.push_back(i);
  }
  features_.push_back(std::move(features));
}

std::vector<int> PlaceIndex::most_alike(const PlaceFeatures& features, int searched, int count) const {
  constexpr int kFar = std::numeric_limits<int>::max();
  std::vector<float> votes(static_cast<std::size_t>(searched), 0.0F);
  std::vector<int> distance_of(votes.size(), kFar), alike, distances;
  for (int i = 0; i < features.size(); ++i) {
    alike.clear();
    for_neighbors(features.descriptor(i), [&](int keyframe, int distance) {
      if (keyframe >= searched) return;
      int& least = distance_of[static_cast<std::size_t>(keyframe)];
      if (least == kFar) alike.push_back(keyframe);
      least = std::min(least, distance);
    });
    distances.clear();
    for (const int keyframe : alike)
      distances.push_back(std::max(1, std::exchange(distance_of[static_cast<std::size_t>(keyframe)], kFar)));
    if (distances.empty()) continue;
    std::vector<int> sorted = distances;
    const auto next = sorted.begin() + static_cast<std::ptrdiff_t>(
                                           std::min(static_cast<std::size_t>(count), sorted.size() - 1));
    std::nth_element(sorted.begin(), next, sorted.end());
    for (std::size_t k = 0; k < alike.size(); ++k)
      if (distances[k] < *next)
        votes[static_cast<std::size_t>(alike[k])] +=
            std::log(static_cast<float>(*next) / static_cast<float>(distances[k]));
  }

  std::vector<int> order(votes.size());
  std::iota(order.begin(), order.end(), 0);
  const auto kept = std::min(order.size(), static_cast<std::size_t>(count));
  std::partial_sort(
      order.begin(), order.begin() + static_cast<std::ptrdiff_t>(kept), order.end(), [&](int a, int b) {
        const float va = votes[static_cast<std::size_t>(a)], vb = votes[static_cast<std::size_t>(b)];
        return va != vb ? va > vb : a < b;
      });
  order.resize(kept);
  return order;
}

}  // namespace gelslam::loop_closure::detail
