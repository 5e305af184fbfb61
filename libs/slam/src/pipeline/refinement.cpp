#include "gelslam/slam/refinement.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <set>

#include "gelslam/backend/uncertain_motion.hpp"
#include "gelslam/core/index.hpp"
#include "gelslam/core/parallel.hpp"
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

/// A ball around a contact, in its component's frame.
struct Reach {
  Eigen::Vector3d center_mm = Eigen::Vector3d::Zero();
  double radius_mm = -std::numeric_limits<double>::infinity();  // no contact
};

Reach reach_of(const std::vector<Eigen::Vector3d>& points, double pixel_pitch_mm,
               const Pose& component_T_points) {
  if (points.empty()) return {};
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : points) box.extend(point);
  const double beyond_mm = 2 * kContactPointStepPx * pixel_pitch_mm;  // the points are a coarse grid
  return {component_T_points * box.center(), 0.5 * box.diagonal().norm() + beyond_mm};
}

/// Keyframes, and what the pose graph makes of them.
struct PosedKeyframes {
  const std::vector<std::shared_ptr<const Keyframe>>& keyframes;
  const PoseGraphSolution& solution;
  std::vector<std::vector<Eigen::Vector3d>> points;  // coarse_contact_points_mm() of each
  std::vector<Reach> reaches;

  PosedKeyframes(const std::vector<std::shared_ptr<const Keyframe>>& of, const PoseGraphSolution& solved)
      : keyframes(of), solution(solved), points(of.size()), reaches(of.size()) {
    for (std::size_t id = 0; id < of.size(); ++id) {
      if (!of[id]) continue;
      points[id] = coarse_contact_points_mm(*of[id]->surface);
      reaches[id] = reach_of(points[id], of[id]->surface->pixel_pitch_mm,
                             solved.component_T_node.at(static_cast<int>(id)));
    }
  }

  bool may_overlap(int a, int b) const {
    const Reach &one = reaches[index(a)], &other = reaches[index(b)];
    const double apart_mm = one.radius_mm + other.radius_mm;
    return apart_mm > 0 && (one.center_mm - other.center_mm).squaredNorm() < apart_mm * apart_mm;
  }
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
    if (!posed.may_overlap(from, to) || linked.contains({from, to}) || !posed.same_component(from, to))
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
                                              const std::function<bool()>& stop_requested,
                                              ParallelProgress* progress) {
  std::set<std::pair<int, int>> linked;
  for (const PoseGraphEdge& edge : edges)
    linked.emplace(std::min(edge.from, edge.to), std::max(edge.from, edge.to));
  const PosedKeyframes posed(keyframes, solution);
  const MotionCertainty certainty(edges, options.slope_calibration.gradient_scale_sigma);
  std::vector<std::vector<PoseGraphEdge>> found_of(keyframes.size());  // by the later keyframe
  parallel_for(keyframes.size(), options.fusion.threads, [&](std::size_t id) {
    const int to = static_cast<int>(id);
    if (!keyframes[id] || stop_requested()) return;
    for (const Candidate& candidate : overlapping(to, posed, linked, options)) {
      const int from = candidate.from;
      const RegistrationResult result =
          verify(*keyframes[index(to)]->reference, *keyframes[index(from)]->reference,
                 {posed.relative(from, to), PlacePrior::known, certainty.sigma_mm(from, to)},
                 options.registration, options.verification);
      if (result.ok())
        found_of[id].push_back({from, to, result.target_T_reference, result.information, EdgeKind::loop,
                                result.shared_center_mm});
    }
    if (progress) progress->step();
  });
  std::vector<PoseGraphEdge> found;
  for (const auto& edges_of : found_of) found.insert(found.end(), edges_of.begin(), edges_of.end());
  return found;
}

}  // namespace gelslam
