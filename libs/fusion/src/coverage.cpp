#include <Eigen/Geometry>
#include <algorithm>

#include "gelslam/core/error.hpp"
#include "gelslam/fusion/fusion.hpp"
#include "patch.hpp"

namespace gelslam {
namespace {

using fusion::detail::Observation;
using fusion::detail::Patch;

constexpr int kStride = 4;  ///< numerics: every 4th pixel in both directions stands for 16

struct Point {
  Eigen::Vector3f position_mm, normal;
  float weight;
};

struct Candidate {
  int id = 0;
  Patch patch;
  std::vector<Point> uncovered;  ///< what no chosen keyframe shows
  double gain = 0;               ///< weight of `uncovered`, pixels
  Eigen::AlignedBox3f box;       ///< of all its points
  bool chosen = false;
};

std::vector<Candidate> candidates(const std::vector<PosedSurface>& patches) {
  std::vector<Candidate> result;
  for (const PosedSurface& posed : patches) {
    auto patch = Patch::prepare(posed, 1.0);
    if (!patch) continue;
    Candidate c{posed.id, std::move(*patch), {}, 0, {}, false};
    c.patch.for_each_point(kStride, [&](const Eigen::Vector3f& p, const Eigen::Vector3f& normal, float w) {
      c.uncovered.push_back({p, normal, w});
      c.box.extend(p);
      c.gain += kStride * kStride * static_cast<double>(w);
    });
    result.push_back(std::move(c));
  }
  std::sort(result.begin(), result.end(), [](const Candidate& a, const Candidate& b) { return a.id < b.id; });
  return result;
}

/// Takes from `candidate` what `chosen` shows at least half as well, from the same side.
void cover(Candidate& candidate, const Candidate& chosen, float reach_mm) {
  std::erase_if(candidate.uncovered, [&](const Point& p) {
    Observation seen;
    return chosen.patch.observe(p.position_mm, reach_mm, seen) && seen.normal.dot(p.normal) > 0 &&
           seen.weight >= 0.5f * p.weight;
  });
  candidate.gain = 0;
  for (const Point& p : candidate.uncovered)
    candidate.gain += kStride * kStride * static_cast<double>(p.weight);
}

Eigen::AlignedBox3f grown(Eigen::AlignedBox3f box, float margin_mm) {
  box.min().array() -= margin_mm;
  box.max().array() += margin_mm;
  return box;
}

}  // namespace

std::vector<int> select_coverage_keyframes(const std::vector<PosedSurface>& patches,
                                           const CoverageOptions& options) {
  if (!(options.max_distance_mm > 0)) throw Error("the coverage distance has to be positive");
  const float reach = static_cast<float>(options.max_distance_mm);
  std::vector<Candidate> all = candidates(patches);
  std::vector<int> ids;
  const auto less_gain = [](const Candidate& a, const Candidate& b) { return a.gain < b.gain; };
  for (std::size_t round = 0; round < all.size(); ++round) {
    Candidate& best = *std::max_element(all.begin(), all.end(), less_gain);  // of equals the lowest id
    if (best.chosen || best.gain < options.min_uncovered_weight) break;
    best.chosen = true;
    best.gain = -1;
    ids.push_back(best.id);
    const Eigen::AlignedBox3f box = grown(best.box, reach);
    for (Candidate& other : all) {
      if (!other.chosen && box.intersects(other.box)) cover(other, best, reach);
    }
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

}  // namespace gelslam
