#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "patch.hpp"

namespace gelslam::fusion::detail {

/// The fused surface's signed distance at a point.
struct FieldValue {
  float distance_mm = 0;   ///< positive outside the object
  float weight = 0;        ///< summed over the observations behind it
  float best = 0;          ///< the largest of them
  Eigen::Vector3f normal;  ///< unit, out of the object: the weighted mean of what was observed
  int keyframe = 0;        ///< the one that sees it best
};

/// A weighted mean of distances. It is summed in whole numbers, so that observations can be added and taken
/// away in any order and leave exactly the same sum; 2^-16 of the truncation is much finer than any height.
template <typename Integer>
struct DistanceSumOf {
  Integer weight = 0, weighted_distance = 0;
};
using DistanceSum = DistanceSumOf<std::int32_t>;
constexpr std::size_t kMaxSummedPatches = 30000;  ///< of weights up to 1: their sums fit 32 bits

/// The signed distance field that all patches together say: a weighted mean over those that see the same side
/// of the object, and the intersection of the half-spaces of different sides (own; docs/algorithms.md).
class Field {
 public:
  Field(float truncation_mm, float end_weight)
      : truncation_mm_(truncation_mm), inverse_truncation_(1.0f / truncation_mm), end_weight_(end_weight) {}

  float truncation_mm() const { return truncation_mm_; }
  /// Best single weight at which the mesh ends.
  float end_weight() const { return end_weight_; }
  /// Best single weight below which one side of a point does not count as touched: reached about two voxels
  /// beyond the mesh's end, l ln((0.06 + 0.05) / (0.06 / 6 + 0.05)) = 0.15 mm (mask_weight()).
  float touched_weight() const { return end_weight_ / 6; }
  /// Of the largest weight of what is observed at a point, a logarithm that rises evenly toward the middle of
  /// a patch.
  float log_weight(const Eigen::Vector3f& point_mm, const PatchList& listed) const;
  static float log_weight(float weight) { return std::log(weight + Patch::kMinPixelWeight); }

  /// Value at a point, asking the listed patches. `scratch` is reused between calls. False where unobserved.
  bool evaluate(const Eigen::Vector3f& point_mm, const PatchList& listed, std::vector<Observation>& scratch,
                FieldValue& out) const;

  /// What one observation adds to its side's sum.
  DistanceSum term(float distance_mm, float weight) const {
    const float x = distance_mm * inverse_truncation_;
    const float y = 1.0f - x * x;
    // Far observations fade out, so that the mean has no step where a patch's band ends.
    const float w = kUnit * weight * y * y;
    return {static_cast<std::int32_t>(w + 0.5f), static_cast<std::int32_t>(w * x + std::copysign(0.5f, x))};
  }
  template <typename Integer>
  float mean_mm(const DistanceSumOf<Integer>& sum) const {
    return truncation_mm_ * (static_cast<float>(sum.weighted_distance) / static_cast<float>(sum.weight));
  }

 private:
  static constexpr float kUnit = 65536.0f;
  static_assert(static_cast<float>(kMaxSummedPatches) * kUnit < 2147483648.0f, "weights up to 1 fit 32 bits");

  float truncation_mm_, inverse_truncation_;
  float end_weight_;
};

}  // namespace gelslam::fusion::detail
