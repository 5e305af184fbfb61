#include "place_index.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace gelslam::loop_closure::detail {

PlaceIndex::PlaceIndex() {
  std::mt19937_64 random;  // with its standard seed: the same on every machine
  projections_.resize(static_cast<std::size_t>(kTables * kBits * kDescriptorSize));
  for (float& p : projections_) {
    int sum = 0;  // of 8 bytes: near enough to a normal, and the same on every machine
    for (std::uint64_t bytes = random(), k = 0; k < 8; ++k, bytes >>= 8)
      sum += static_cast<int>(bytes & 255U);
    p = static_cast<float>(sum) - 8.0F * 127.5F;
  }
  // Descriptors are never negative: rows that sum to zero look at their shape, not at their mean.
  for (auto row = projections_.begin(); row != projections_.end(); row += kDescriptorSize) {
    const float mean = std::accumulate(row, row + kDescriptorSize, 0.0F) / kDescriptorSize;
    std::for_each(row, row + kDescriptorSize, [mean](float& p) { p -= mean; });
  }
  for (auto& table : tables_) table.resize(std::size_t{1} << kBits);
}

std::array<float, PlaceIndex::kTables * PlaceIndex::kBits> PlaceIndex::project(
    const std::int16_t* descriptor) const {
  std::array<float, kTables * kBits> result;
  const float* row = projections_.data();
  for (float& value : result) {
    value = 0;
    for (int k = 0; k < kDescriptorSize; ++k) value += row[k] * static_cast<float>(descriptor[k]);
    row += kDescriptorSize;
  }
  return result;
}

void PlaceIndex::add(const PlaceFeatures& features) {
  const int keyframe = static_cast<int>(feature_count_.size());
  feature_count_.push_back(features.size());
  for (int i = 0; i < features.size(); ++i) {
    const auto projected = project(features.descriptor(i));
    for (int table = 0; table < kTables; ++table) {
      std::uint32_t key = 0;
      for (int bit = 0; bit < kBits; ++bit)
        key |= static_cast<std::uint32_t>(projected[static_cast<std::size_t>(table * kBits + bit)] > 0)
               << bit;
      tables_[static_cast<std::size_t>(table)][key].push_back(keyframe);
    }
  }
}

void PlaceIndex::truncate(int count) {
  feature_count_.resize(static_cast<std::size_t>(count));
  for (auto& table : tables_)
    for (std::vector<int>& bucket : table)
      while (!bucket.empty() && bucket.back() >= count) bucket.pop_back();
}

std::vector<int> PlaceIndex::most_alike(const PlaceFeatures& features, int searched, int count) const {
  std::vector<float> votes(static_cast<std::size_t>(searched), 0.0F);
  for (int i = 0; i < features.size(); ++i) {
    const auto projected = project(features.descriptor(i));
    for (int table = 0; table < kTables; ++table) {
      const float* values = projected.data() + table * kBits;
      std::uint32_t key = 0;
      int least_sure = 0;
      for (int bit = 0; bit < kBits; ++bit) {
        key |= static_cast<std::uint32_t>(values[bit] > 0) << bit;
        if (std::abs(values[bit]) < std::abs(values[least_sure])) least_sure = bit;
      }
      for (const std::uint32_t probe : {key, key ^ (1U << least_sure)})
        for (const int keyframe : tables_[static_cast<std::size_t>(table)][probe])
          if (keyframe < searched) votes[static_cast<std::size_t>(keyframe)] += 1.0F;
    }
  }
  // Chance votes grow with a keyframe's features; their scatter with the root.
  for (std::size_t k = 0; k < votes.size(); ++k)
    votes[k] /= std::sqrt(static_cast<float>(std::max(1, feature_count_[k])));

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
