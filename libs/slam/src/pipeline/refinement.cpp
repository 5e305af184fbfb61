// Overlap edges (not in the paper). When the pose graph is solved, the overlap of every pair of keyframes is
// predicted from their poses: the fraction of points of the smaller contact that lie on the other contact,
// within a tolerance of height. The pairs with the largest overlap that have no edge yet are verified from
// the predicted pose and become loop edges. This replaces drift along chains of keyframes by direct
// measurements.

#include "gelslam/slam/refinement.hpp"

#include <algorithm>
#include <optional>
#include <set>

#include "gelslam/backend/uncertain_motion.hpp"
#include "gelslam/core/index.hpp"
#include "gelslam/core/parallel.hpp"
#include "gelslam/surface/contact_overlap.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {
namespace {

/// Position and depth of a contact on a coarse grid. It is small enough to be kept for every keyframe of a
/// large map, where decompressing two surfaces for each of the many pairs would take minutes.
class ContactGrid {
 public:
  explicit ContactGrid(const Surface& surface)
      : points_mm_(coarse_contact_points_mm(surface)),
        extent_(extent_of(points_mm_)),
        coarse_(surface, /*cell_px=*/4) {}

  /// Returns the fraction of the smaller contact that coincides with the other one.
  static double overlap(const ContactGrid& a, const ContactGrid& b, const Pose& a_T_b) {
    if (!may_overlap(a.extent_, b.extent_, a_T_b)) return 0.0;
    return a.points_mm_.size() < b.points_mm_.size() ? shown_share(a.points_mm_, b.coarse_, a_T_b.inverse())
                                                     : shown_share(b.points_mm_, a.coarse_, a_T_b);
  }

 private:
  std::vector<Eigen::Vector3d> points_mm_;
  ContactExtent extent_;
  ContactRelief coarse_;
};

struct Candidate {
  int from;
  double overlap;
};

/// A keyframe at its pose in the solved pose graph.
struct PosedKeyframe {
  /// Null if there is no keyframe with this id, or if it is a patch.
  std::shared_ptr<const Keyframe> keyframe;
  Pose component_T_keyframe = Pose::Identity();
  int component = -1;
  std::optional<ContactGrid> contact;
};

std::vector<PosedKeyframe> posed(const std::vector<std::shared_ptr<const Keyframe>>& keyframes,
                                 const PoseGraphSolution& solution, int threads) {
  std::vector<PosedKeyframe> all(keyframes.size());
  parallel_for(keyframes.size(), threads, [&](std::size_t i) {
    const auto& keyframe = keyframes[i];
    if (keyframe && !keyframe->is_patch)
      all[i] = {keyframe, solution.component_T_node.at(keyframe->id),
                solution.component_of_node.at(keyframe->id), ContactGrid(*keyframe->surface.get())};
  });
  return all;
}

/// Returns earlier keyframes that should overlap `to` by enough to be verified and have no edge to it, those
/// with the largest overlap first, at most as many as the options allow.
std::vector<Candidate> overlapping(int to, const std::vector<PosedKeyframe>& keyframes,
                                   const std::set<std::pair<int, int>>& linked, const SlamOptions& options) {
  const PosedKeyframe& newer = keyframes[index(to)];
  std::vector<Candidate> candidates;
  for (int from = 0; from < to; ++from) {
    const PosedKeyframe& older = keyframes[index(from)];
    if (!older.keyframe || older.component != newer.component) continue;
    const double share = ContactGrid::overlap(
        *older.contact, *newer.contact, older.component_T_keyframe.inverse() * newer.component_T_keyframe);
    if (share >= options.verification.curvature.min_scr && !linked.contains({from, to}))
      candidates.push_back({from, share});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.overlap > b.overlap; });
  if (candidates.size() > index(options.refinement.max_pairs_per_keyframe))
    candidates.resize(index(options.refinement.max_pairs_per_keyframe));
  return candidates;
}

}  // namespace

double gradient_scale_sigma(const std::vector<std::shared_ptr<const Keyframe>>& keyframes,
                            const GradientScaleOptions& options) {
  double slope_sigma_ratio = 0;
  for (const auto& keyframe : keyframes)
    if (keyframe)
      slope_sigma_ratio = std::max(slope_sigma_ratio, keyframe->surface.facts().slope_sigma_ratio);
  return options.sigma * slope_sigma_ratio;
}

double contact_overlap(const Surface& a, const Surface& b, const Pose& a_T_b) {
  return ContactGrid::overlap(ContactGrid(a), ContactGrid(b), a_T_b);
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
  const std::vector<PosedKeyframe> all = posed(keyframes, solution, options.fusion.threads);
  const auto motion_between =
      motions_between(edges, solution.edge_outlier, gradient_scale_sigma(keyframes, options.gradient_scale));
  std::vector<std::vector<PoseGraphEdge>> found(all.size());  // Indexed by the newer keyframe.
  parallel_for(all.size(), options.fusion.threads, [&](std::size_t i) {
    const PosedKeyframe& newer = all[i];
    if (!newer.keyframe || stop_requested()) return;
    const int to = newer.keyframe->id;
    for (const Candidate& candidate : overlapping(to, all, linked, options)) {
      const int from = candidate.from;
      const PosedKeyframe& older = all[index(from)];
      const std::optional<UncertainPose> motion = motion_between(from, to);
      UncertainPose older_T_newer = motion.value_or(UncertainPose{});
      older_T_newer.pose = older.component_T_keyframe.inverse() * newer.component_T_keyframe;
      const RegistrationResult result =
          verify(*newer.keyframe->reference.get(), *older.keyframe->reference.get(), older_T_newer,
                 motion ? PlacePrior::odometry : PlacePrior::loop_candidate, options.registration,
                 options.verification);
      if (result.ok())
        found[i].push_back({from, to, result.target_T_reference, result.information, EdgeKind::loop,
                            result.shared_center_mm});
    }
    if (progress) progress->step();
  });
  std::vector<PoseGraphEdge> in_order;
  for (const auto& of_keyframe : found)
    in_order.insert(in_order.end(), of_keyframe.begin(), of_keyframe.end());
  return in_order;
}

}  // namespace gelslam
