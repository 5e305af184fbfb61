#pragma once

#include <cstdint>

namespace gelslam::simulation::detail {

/// A stateless hash (finalizer of splitmix64; Steele et al., 2014) that gives the same number for the same
/// key on any computer.
inline std::uint64_t hash(std::uint64_t key) {
  key += 0x9e3779b97f4a7c15ULL;
  key = (key ^ (key >> 30)) * 0xbf58476d1ce4e5b9ULL;
  key = (key ^ (key >> 27)) * 0x94d049bb133111ebULL;
  return key ^ (key >> 31);
}

inline std::uint64_t hash(std::uint64_t a, std::uint64_t b) {
  return hash(hash(a) ^ (b * 0xd1342543de82ef95ULL));
}

/// A small generator of random numbers. std::*_distribution is not used, as its results differ between
/// standard libraries.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(hash(seed)) {}
  double uniform() { return static_cast<double>(hash(state_++) >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

 private:
  std::uint64_t state_;
};

}  // namespace gelslam::simulation::detail
