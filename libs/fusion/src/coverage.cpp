#include <algorithm>
#include <numeric>

#include "gelslam/core/error.hpp"
#include "gelslam/fusion/fusion.hpp"
#include "patch.hpp"

namespace gelslam {
namespace {

using fusion::detail::Observation;
using fusion::detail::Patch;

constexpr int stride = 4;  ///< every 4th pixel in both directions stands for 16

struct Candidate {
  int id = 0;
  Patch patch;
  double weight = 0;  ///< of the whole patch, pixels
  Eigen::AlignedBox3f box;
};

std::vector<Candidate> candidates(const std::vector<PosedSurface>& patches) {
  std::vector<Candidate> result;
  for (const PosedSurface& posed : patches) {
    auto patch = Patch::prepare(posed, 1.0);
    if (!patch) continue;
    Candidate c{posed.id, std::move(*patch), 0, {}};
    c.patch.for_each_point(stride, [&](const Eigen::Vector3f& p, const Eigen::Vector3f&, float w) {
      c.weight += stride * stride * w;
      c.box.extend(p);
    });
    result.push_back(std::move(c));
  }
  std::sort(result.begin(), result.end(), [](const Candidate& a, const Candidate& b) {
    return a.weight != b.weight ? a.weight > b.weight : a.id < b.id;
  });
  return result;
}

/// Weight of what `candidate` shows and none of `others` does, pixels.
double uncovered_weight(const Candidate& candidate, const std::vector<const Candidate*>& others,
                        float reach_mm) {
  double uncovered = 0;
  candidate.patch.for_each_point(
      stride, [&](const Eigen::Vector3f& p, const Eigen::Vector3f& normal, float w) {
        float best = 0;
        for (const Candidate* other : others) {
          Observation seen;
          if (other->patch.observe(p, reach_mm, seen) && seen.normal.dot(normal) > 0)
            best = std::max(best, seen.weight);
          if (best >= w) return;
        }
        uncovered += stride * stride * (w - best);
      });
  return uncovered;
}

}  // namespace

std::vector<int> select_coverage_keyframes(const std::vector<PosedSurface>& patches,
                                           const CoverageOptions& options) {
  if (!(options.max_distance_mm > 0)) throw Error("the coverage distance has to be positive");
  const std::vector<Candidate> all = candidates(patches);
  std::vector<const Candidate*> kept;
  const float reach = static_cast<float>(options.max_distance_mm);
  for (const Candidate& candidate : all) {
    Eigen::AlignedBox3f box = candidate.box;
    box.min().array() -= reach;
    box.max().array() += reach;
    std::vector<const Candidate*> neighbours;
    std::copy_if(kept.begin(), kept.end(), std::back_inserter(neighbours),
                 [&](const Candidate* other) { return box.intersects(other->box); });
    if (uncovered_weight(candidate, neighbours, reach) >= options.min_uncovered_weight)
      kept.push_back(&candidate);
  }
  std::vector<int> ids;
  for (const Candidate* candidate : kept) ids.push_back(candidate->id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

}  // namespace gelslam
