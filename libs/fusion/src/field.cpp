#include "field.hpp"

#include <algorithm>

namespace gelslam::fusion::detail {
namespace {

/// Far observations fade out, so that the mean has no step where a patch's band ends.
float fade(float distance_mm, float truncation_mm) {
  const float x = distance_mm / truncation_mm;
  const float y = 1.0f - x * x;
  return y * y;
}

}  // namespace

bool Field::evaluate(const Eigen::Vector3f& point_mm, const std::vector<int>& listed,
                     std::vector<Observation>& scratch, FieldValue& out) const {
  scratch.clear();
  float best = 0;
  for (const int i : listed) {
    Observation o;
    if (!patches_[static_cast<std::size_t>(i)].observe(point_mm, truncation_mm_, o)) continue;
    scratch.push_back(o);
    best = std::max(best, o.weight);
  }
  if (best < min_weight_) return false;

  // One side of the object after the other, each led by its heaviest observation.
  constexpr int max_sides = 3;
  bool found = false;
  auto rest = scratch.begin();
  for (int side = 0; side < max_sides && rest != scratch.end(); ++side) {
    const auto heavier = [](const Observation& a, const Observation& b) { return a.weight < b.weight; };
    const Eigen::Vector3f lead = std::max_element(rest, scratch.end(), heavier)->direction;
    const auto end = std::stable_partition(rest, scratch.end(),
                                           [&](const Observation& o) { return o.direction.dot(lead) > 0; });
    FieldValue value{0, 0, Eigen::Vector3f::Zero()};
    float faded_weight = 0;
    best = 0;
    for (auto o = rest; o != end; ++o) {
      const float w = o->weight * fade(o->distance_mm, truncation_mm_);
      value.distance_mm += w * o->distance_mm;
      value.normal += w * o->normal;
      value.weight += o->weight;
      faded_weight += w;
      best = std::max(best, o->weight);
    }
    rest = end;
    if (best < min_weight_ || !(faded_weight > 0)) continue;
    value.distance_mm /= faded_weight;
    value.normal.normalize();
    if (!found || value.distance_mm > out.distance_mm) out = value;
    found = true;
  }
  return found;
}

}  // namespace gelslam::fusion::detail
