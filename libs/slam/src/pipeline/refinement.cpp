#include "gelslam/slam/refinement.hpp"

#include <algorithm>
#include <set>

#include "gelslam/backend/uncertain_motion.hpp"
#include "gelslam/core/index.hpp"
#include "gelslam/slam/slam_options.hpp"
#include "gelslam/surface/contact_points.hpp"

namespace gelslam {
namespace {

/// Share of the points that land on the other patch's contact, close to its height.
double overlap(const std::vector<Eigen::Vector3d>& points, const Surface& other, const Pose& other_T_points) {
  const auto inside = std::count_if(points.begin(), points.end(),
                                    [&](const auto& point) { return shows(other, other_T_points * point); });
  return points.empty() ? 0.0 : static_cast<double>(inside) / static_cast<double>(points.size());
}

/// contact_overlap() of surfaces whose coarse points are known.
double overlap_share(const Surface& a, const std::vector<Eigen::Vector3d>& points_a, const Surface& b,
                     const std::vector<Eigen::Vector3d>& points_b, const Pose& a_T_b) {
  if (a_T_b.linear()(2, 2) < 0.3) return 0.0;
  return points_a.size() < points_b.size() ? overlap(points_a, b, a_T_b.inverse())
                                           : overlap(points_b, a, a_T_b);
}

struct Candidate {
  int from;
  double overlap;
};

/// Keyframes, and what the pose graph makes of them.
struct PosedKeyframes {
  const std::vector<std::shared_ptr<const Keyframe>>& keyframes;
  const PoseGraphSolution& solution;
  std::vector<std::vector<Eigen::Vector3d>> points;  // coarse_contact_points_mm() of each

  bool same_component(int a, int b) const {
    return solution.component_of_node.at(a) == solution.component_of_node.at(b);
  }
  Pose relative(int from, int to) const {
    return solution.component_T_node.at(from).inverse() * solution.component_T_node.at(to);
  }
  double overlap_between(int from, int to) const {
    return overlap_share(*keyframes[index(from)]->surface, points[index(from)],
                         *keyframes[index(to)]->surface, points[index(to)], relative(from, to));
  }
};

/// Earlier keyframes that should share enough with `to` to be verified and are not linked to it, most overlap
/// first, as many as allowed.
std::vector<Candidate> overlapping(int to, const PosedKeyframes& posed,
                                   const std::set<std::pair<int, int>>& linked, const SlamOptions& options) {
  std::vector<Candidate> candidates;
  for (int from = 0; from < to; ++from) {
    if (!posed.keyframes[index(from)] || linked.contains({from, to}) || !posed.same_component(from, to))
      continue;
    const double share = posed.overlap_between(from, to);
    if (share >= options.verification.min_scr) candidates.push_back({from, share});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.overlap > b.overlap; });
  if (candidates.size() > index(options.refinement.max_pairs_per_keyframe))
    candidates.resize(index(options.refinement.max_pairs_per_keyframe));
  return candidates;
}

}  // namespace

double contact_overlap(const Surface& a, const Surface& b, const Pose& a_T_b) {
  return overlap_share(a, coarse_contact_points_mm(a), b, coarse_contact_points_mm(b), a_T_b);
}

std::vector<PoseGraphEdge> find_overlap_edges(const std::vector<std::shared_ptr<const Keyframe>>& keyframes,
                                              const PoseGraphSolution& solution,
                                              const std::vector<PoseGraphEdge>& edges,
                                              const SlamOptions& options,
                                              const std::function<bool()>& stop_requested) {
  std::set<std::pair<int, int>> linked;
  for (const PoseGraphEdge& edge : edges)
    linked.emplace(std::min(edge.from, edge.to), std::max(edge.from, edge.to));
  PosedKeyframes posed{keyframes, solution, {}};
  for (const auto& keyframe : keyframes)
    posed.points.push_back(keyframe ? coarse_contact_points_mm(*keyframe->surface)
                                    : std::vector<Eigen::Vector3d>());

  const MotionCertainty certainty(edges, options.slope_calibration.gradient_scale_sigma);
  std::vector<PoseGraphEdge> found;
  for (int to = 0; to < static_cast<int>(keyframes.size()) && !stop_requested(); ++to) {
    if (!keyframes[index(to)]) continue;
    for (const Candidate& candidate : overlapping(to, posed, linked, options)) {
      const int from = candidate.from;
      const RegistrationResult result =
          verify(*keyframes[index(to)]->reference, *keyframes[index(from)]->reference,
                 {posed.relative(from, to), PlacePrior::known, certainty.sigma_mm(from, to)},
                 options.registration, options.verification);
      if (result.ok())
        found.push_back({from, to, result.target_T_reference, result.information, EdgeKind::loop,
                         result.shared_center_mm});
    }
  }
  return found;
}

}  // namespace gelslam
