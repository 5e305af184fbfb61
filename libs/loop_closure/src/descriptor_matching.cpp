// Brute-force matching of SIFT descriptors: mutual nearest neighbors (L2) that pass the ratio test in both
// directions (Lowe 2004). All distances between two keyframes are computed once.

#include <limits>

#include "gelslam/core/target_clones.hpp"
#include "place_features.hpp"

namespace gelslam::loop_closure::detail {

GELSLAM_CLONES void squared_distances(const std::uint8_t* query, const std::uint8_t* others, int count,
                                      int* result) {
  for (int i = 0; i < count; ++i) {
    const std::uint8_t* other = others + static_cast<std::ptrdiff_t>(i) * kDescriptorSize;
    int sum = 0;
    for (int k = 0; k < kDescriptorSize; ++k) {
      // With differences of 16 bits the compiler vectorizes to an instruction that multiplies and adds pairs.
      const auto difference = static_cast<std::int16_t>(static_cast<std::int16_t>(query[k]) -
                                                        static_cast<std::int16_t>(other[k]));
      sum += difference * difference;
    }
    result[i] = sum;
  }
}

namespace {

struct Nearest {
  int index = -1;
  int best = std::numeric_limits<int>::max(), second = best;

  void see(int i, int distance) {
    if (distance < best) {
      second = best;
      best = distance;
      index = i;
    } else if (distance < second) {
      second = distance;
    }
  }

  bool clear(double max_ratio) const {
    return second == std::numeric_limits<int>::max() ||
           static_cast<double>(best) < max_ratio * max_ratio * static_cast<double>(second);
  }
};

}  // namespace

std::vector<Match> match_features(const PlaceFeatures& a, const PlaceFeatures& b, double max_ratio) {
  std::vector<Nearest> nearest_of_a(static_cast<std::size_t>(a.size())),
      nearest_of_b(static_cast<std::size_t>(b.size()));
  std::vector<int> distances(nearest_of_b.size());
  for (int i = 0; i < a.size(); ++i) {
    squared_distances(a.descriptor(i), b.descriptors.data(), b.size(), distances.data());
    for (int j = 0; j < b.size(); ++j) {
      nearest_of_a[static_cast<std::size_t>(i)].see(j, distances[static_cast<std::size_t>(j)]);
      nearest_of_b[static_cast<std::size_t>(j)].see(i, distances[static_cast<std::size_t>(j)]);
    }
  }
  std::vector<Match> matches;
  for (int i = 0; i < a.size(); ++i) {
    const Nearest& there = nearest_of_a[static_cast<std::size_t>(i)];
    if (there.index < 0 || !there.clear(max_ratio)) continue;
    const Nearest& back = nearest_of_b[static_cast<std::size_t>(there.index)];
    if (back.index == i && back.clear(max_ratio)) matches.push_back({i, there.index});
  }
  return matches;
}

}  // namespace gelslam::loop_closure::detail
