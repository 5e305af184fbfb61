#include "gelslam/slam/refinement.hpp"

#include <algorithm>
#include <set>

namespace gelslam {
namespace {

constexpr int kGridStepPx = 8;

/// Coarse points of a patch, for telling which patches overlap without touching every pixel.
std::vector<Eigen::Vector3d> coarse_points(const Surface& surface) {
  std::vector<Eigen::Vector3d> points;
  const double center_u = surface.contact.cols * 0.5 - 0.5, center_v = surface.contact.rows * 0.5 - 0.5;
  for (int v = kGridStepPx / 2; v < surface.contact.rows; v += kGridStepPx)
    for (int u = kGridStepPx / 2; u < surface.contact.cols; u += kGridStepPx)
      if (surface.contact(v, u))
        points.emplace_back((u - center_u) * surface.pixel_pitch_mm, (v - center_v) * surface.pixel_pitch_mm,
                            static_cast<double>(surface.height_mm(v, u)));
  return points;
}

/// Share of the points that land on the other patch's contact, close to its height.
double overlap(const std::vector<Eigen::Vector3d>& points, const Surface& other, const Pose& other_T_points) {
  constexpr double kHeightToleranceMm = 0.5;
  int inside = 0;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d p = other_T_points * point;
    const int u = static_cast<int>(std::lround(p.x() / other.pixel_pitch_mm + other.contact.cols * 0.5 - 0.5));
    const int v = static_cast<int>(std::lround(p.y() / other.pixel_pitch_mm + other.contact.rows * 0.5 - 0.5));
    if (u < 0 || v < 0 || u >= other.contact.cols || v >= other.contact.rows || !other.contact(v, u)) continue;
    if (std::abs(p.z() - static_cast<double>(other.height_mm(v, u))) < kHeightToleranceMm) ++inside;
  }
  return points.empty() ? 0.0 : static_cast<double>(inside) / static_cast<double>(points.size());
}

struct Candidate {
  int from;
  double overlap;
};

std::size_t index(int id) { return static_cast<std::size_t>(id); }

/// Keyframes, and what the pose graph makes of them.
struct PosedKeyframes {
  const std::vector<std::shared_ptr<const Keyframe>>& keyframes;
  const PoseGraphSolution& solution;
  std::vector<std::vector<Eigen::Vector3d>> points;  // coarse_points() of each

  bool same_group(int a, int b) const { return solution.group_of_node.at(a) == solution.group_of_node.at(b); }
  Pose relative(int from, int to) const {
    return solution.group_T_node.at(from).inverse() * solution.group_T_node.at(to);
  }
  /// Share of the smaller patch that should lie on the larger one.
  double overlap_share(int from, int to) const {
    const Pose from_T_to = relative(from, to);
    // Patches that face away from each other are opposite sides of a thin object, not an overlap.
    if (from_T_to.linear()(2, 2) < 0.3) return 0.0;
    if (points[index(from)].size() < points[index(to)].size())
      return overlap(points[index(from)], *keyframes[index(to)]->surface, from_T_to.inverse());
    return overlap(points[index(to)], *keyframes[index(from)]->surface, from_T_to);
  }
};

/// Earlier keyframes that should overlap with `to` and are not linked to it, most overlap first, as many as allowed.
std::vector<Candidate> overlapping(int to, const PosedKeyframes& posed, const std::set<std::pair<int, int>>& linked,
                                   const RefinementOptions& options) {
  std::vector<Candidate> candidates;
  for (int from = 0; from < to; ++from) {
    if (!posed.keyframes[index(from)] || linked.contains({from, to}) || !posed.same_group(from, to)) continue;
    const double share = posed.overlap_share(from, to);
    if (share >= options.min_overlap) candidates.push_back({from, share});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.overlap > b.overlap; });
  if (candidates.size() > index(options.max_pairs_per_keyframe)) candidates.resize(index(options.max_pairs_per_keyframe));
  return candidates;
}

}  // namespace

std::vector<PoseGraphEdge> densify(const std::vector<std::shared_ptr<const Keyframe>>& keyframes,
                                   const PoseGraphSolution& solution, const std::vector<PoseGraphEdge>& edges,
                                   const RefinementOptions& options,
                                   const std::function<bool()>& stop_requested) {
  std::set<std::pair<int, int>> linked;
  for (const PoseGraphEdge& edge : edges) linked.emplace(std::min(edge.from, edge.to), std::max(edge.from, edge.to));
  PosedKeyframes posed{keyframes, solution, {}};
  for (const auto& keyframe : keyframes)
    posed.points.push_back(keyframe ? coarse_points(*keyframe->surface) : std::vector<Eigen::Vector3d>());

  std::vector<PoseGraphEdge> found;
  for (int to = 0; to < static_cast<int>(keyframes.size()) && !stop_requested(); ++to) {
    if (!keyframes[index(to)]) continue;
    for (const Candidate& candidate : overlapping(to, posed, linked, options)) {
      const int from = candidate.from;
      const RegistrationResult result = register_normal_flow(*keyframes[index(to)]->reference, *keyframes[index(from)]->surface,
                                                             posed.relative(from, to), options.registration);
      if (result.ok())
        found.push_back({from, to, result.target_T_reference, result.information, EdgeKind::loop, result.shared_center_mm});
    }
  }
  return found;
}

}  // namespace gelslam
