#pragma once

#include <vector>

#include "patch.hpp"

namespace gelslam::fusion::detail {

/// The fused surface's signed distance at a point.
struct FieldValue {
  float distance_mm = 0;   ///< positive outside the object
  float weight = 0;        ///< summed over the observations behind it
  Eigen::Vector3f normal;  ///< unit, out of the object: the weighted mean of what was observed
};

/// The signed distance field that all patches together say: a weighted mean over those that see the same side
/// of the object, and the intersection of the half-spaces of different sides (own; docs/fusion.md).
class Field {
 public:
  Field(const std::vector<Patch>& patches, float truncation_mm, float min_weight)
      : patches_(patches), truncation_mm_(truncation_mm), min_weight_(min_weight) {}

  /// Value at a point, asking the listed patches. `scratch` is reused between calls. False where unobserved.
  bool evaluate(const Eigen::Vector3f& point_mm, const std::vector<int>& listed,
                std::vector<Observation>& scratch, FieldValue& out) const;

 private:
  const std::vector<Patch>& patches_;
  float truncation_mm_;
  float min_weight_;
};

}  // namespace gelslam::fusion::detail
