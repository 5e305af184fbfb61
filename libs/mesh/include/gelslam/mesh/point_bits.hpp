#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstdint>

namespace gelslam {

/// A point as a key: blocks of a mesh have exactly the same vertices where they meet.
using PointBits = std::array<std::uint32_t, 3>;

inline PointBits bits_of(const Eigen::Vector3f& p) {
  // Adding zero makes -0 and 0 one.
  return {std::bit_cast<std::uint32_t>(p.x() + 0.0F), std::bit_cast<std::uint32_t>(p.y() + 0.0F),
          std::bit_cast<std::uint32_t>(p.z() + 0.0F)};
}

struct PointBitsHash {
  std::size_t operator()(const PointBits& bits) const {
    std::uint64_t hash = 0x9E3779B97F4A7C15U;
    for (const std::uint32_t part : bits) hash = (hash ^ part) * 0xFF51AFD7ED558CCDU + (hash >> 29);
    return static_cast<std::size_t>(hash);
  }
};

}  // namespace gelslam
