// Evaluates the fused signed distance field at a point (not in the paper; docs/algorithms.md, Fuse).
//
// With the distances d_k and weights w_k of the patches that see the point, and the truncation τ, each side
// of the object has the mean distance Σ w_k (1 - d_k²/τ²)² d_k / Σ w_k (1 - d_k²/τ²)². A side consists of all
// observations whose direction is within 90 degrees of its heaviest one. The value is the largest mean over
// all sides that were touched, which is the intersection of their half-spaces.

#include "field.hpp"

#include <algorithm>

namespace gelslam::fusion::detail {

float Field::log_weight(const Eigen::Vector3f& point_mm, const PatchList& listed) const {
  float best = 0;
  for (const Patch& patch : listed)
    if (Patch::Reading reading; patch.read(point_mm, truncation_mm_, reading))
      best = std::max(best, reading.weight);
  return log_weight(best);
}

bool Field::evaluate(const Eigen::Vector3f& point_mm, const PatchList& listed,
                     std::vector<Observation>& scratch, FieldValue& out) const {
  scratch.clear();
  float best = 0;
  for (const Patch& patch : listed) {
    Observation o;
    if (!patch.observe(point_mm, truncation_mm_, o)) continue;
    scratch.push_back(o);
    best = std::max(best, o.weight);
  }
  if (best < touched_weight()) return false;

  // Each pass takes one side of the object, led by the remaining observation with the largest weight.
  // A point of a surface belongs to at most two sides, one at an edge to three.
  constexpr int kMaxSides = 3;
  bool found = false;
  auto rest = scratch.begin();
  for (int side = 0; side < kMaxSides && rest != scratch.end(); ++side) {
    const auto heavier = [](const Observation& a, const Observation& b) { return a.weight < b.weight; };
    const Observation lead = *std::max_element(rest, scratch.end(), heavier);
    const auto end = std::stable_partition(
        rest, scratch.end(), [&](const Observation& o) { return o.direction.dot(lead.direction) > 0; });
    FieldValue value{0, 0, lead.weight, Eigen::Vector3f::Zero(), lead.keyframe};
    DistanceSumOf<std::int64_t> sum;  // 64 bits, because the number of observations is not limited here.
    for (auto o = rest; o != end; ++o) {
      const DistanceSum t = term(o->distance_mm, o->weight);
      sum.weight += t.weight;
      sum.weighted_distance += t.weighted_distance;
      value.normal += static_cast<float>(t.weight) * o->normal;
      value.weight += o->weight;
    }
    rest = end;
    if (lead.weight < touched_weight() || sum.weight == 0) continue;
    value.distance_mm = mean_mm(sum);
    value.normal.normalize();
    if (!found || value.distance_mm > out.distance_mm) out = value;
    found = true;
  }
  return found;
}

}  // namespace gelslam::fusion::detail
