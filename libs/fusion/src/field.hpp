#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "patch.hpp"

namespace gelslam::fusion::detail {

/// Value of the signed distance field at a point.
struct FieldValue {
  float distance_mm = 0;  ///< positive outside the object
  float weight = 0;       ///< Sum of the weights of the observations.
  float best = 0;         ///< Largest single weight.
  /// Weighted mean of the observed normals; a unit vector that points out of the object.
  Eigen::Vector3f normal;
  int keyframe = 0;  ///< Keyframe with the largest weight.
};

/// Numerator and denominator of a weighted mean of distances. They are integers, so that observations can be
/// added and removed in any order with exactly the same sum. The unit, 2^-16 of the truncation, is much finer
/// than the noise of heights.
template <typename Integer>
struct DistanceSumOf {
  Integer weight = 0, weighted_distance = 0;
};
using DistanceSum = DistanceSumOf<std::int32_t>;
/// With weights up to 1, the sums of this many patches fit into 32 bits.
constexpr std::size_t kMaxSummedPatches = 30000;

/// The signed distance field defined by all patches. Patches that see the same side of the object are
/// averaged by weight; the value is that of the intersection of the half-spaces of different sides (not in
/// the paper; docs/algorithms.md).
class Field {
 public:
  Field(float truncation_mm, float end_weight)
      : truncation_mm_(truncation_mm), inverse_truncation_(1.0f / truncation_mm), end_weight_(end_weight) {}

  float truncation_mm() const { return truncation_mm_; }
  /// Largest single weight at which the mesh ends.
  float end_weight() const { return end_weight_; }
  /// If the largest single weight of a side is below this, the point does not count as touched on that side.
  /// The value is reached about two voxels beyond the end of the mesh: l ln((0.06 + 0.05) / (0.06 / 6 +
  /// 0.05)) = 0.15 mm (mask_weight()).
  float touched_weight() const { return end_weight_ / 6; }
  /// Returns the logarithm of the largest weight of all patches at a point. It increases nearly linearly
  /// toward the middle of a patch.
  float log_weight(const Eigen::Vector3f& point_mm, const PatchList& listed) const;
  static float log_weight(float weight) { return std::log(weight + Patch::kMinPixelWeight); }

  /// Evaluates the field at a point with the listed patches. Returns false if the point was not observed.
  /// `scratch` is reused between calls.
  bool evaluate(const Eigen::Vector3f& point_mm, const PatchList& listed, std::vector<Observation>& scratch,
                FieldValue& out) const;

  /// Returns what one observation adds to the sum of its side.
  DistanceSum term(float distance_mm, float weight) const {
    const float x = distance_mm * inverse_truncation_;
    const float y = 1.0f - x * x;
    // The weight falls to 0 at the truncation, so that the mean has no step where a patch's band ends.
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
