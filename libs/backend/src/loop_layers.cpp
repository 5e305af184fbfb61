// Chooses the loops that may shape the map. The method is not in the paper; it follows pairwise consistency
// maximization (Mangelson et al., ICRA 2018).
//
// Odometry edges form a forest with one tree per trial. Two loops between the same two trees agree when the
// cycle that they close, along the tree paths between their ends, has an error of at most kMaxMismatch
// standard deviations. A gradient scale that all edges share may explain a part of this error
// (UncertainMotion). For each pair of trees, the loop with which most others agree joins them, if at least
// one other loop agrees or if the loop is not tentative. The joining is repeated until nothing changes.
// Finally every loop is accepted that agrees with the tree path between its own ends.
//
// The robust kernel is cut off at the same limit: robust_cost() is a Cauchy cost up to kMaxMismatch and
// constant beyond, so a loop that the rest of the graph contradicts has no weight. Such a cost has several
// minima. kernel_widenings() returns the sequence of kernels, from wide to narrow, with which the solver
// looks for a better one (graduated non-convexity).
//
// Limitation: wrong loops that agree with each other, as on a repeated pattern, outvote a right one.

#include "loop_layers.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/index.hpp"
#include "motion_forest.hpp"

namespace gelslam {
namespace {

using namespace backend::detail;

// At most this many loops between two components are compared with each other, chosen at equal steps along
// the scan. The comparison of all pairs is quadratic, and 24 are enough to find the majority.
constexpr int kMaxCompared = 24;

/// Between two components: the index of the loop with which most others agree (`seed`), and how many loops
/// agree with it, itself included.
struct Agreement {
  std::size_t seed = 0;
  std::ptrdiff_t loops = 0;
};

class Consistency {
 public:
  Consistency(const std::vector<PoseGraphEdge>& edges, double scale_sigma)
      : edges_(edges), scale_sigma_(scale_sigma) {
    for (std::size_t i = 0; i < edges.size(); ++i) {
      motions_.push_back(uncertain_motion(edges[i]));
      if (edges[i].kind == EdgeKind::odometry) tree_edges_.push_back(i);
    }
  }

  std::vector<bool> run() {
    const MotionForest forest = join_trials();
    std::vector<bool> accepted(edges_.size(), true);
    for (std::size_t i = 0; i < edges_.size(); ++i)
      if (const PoseGraphEdge& edge = edges_[i]; edge.kind == EdgeKind::loop)
        accepted[i] = forest.tree(edge.from) == forest.tree(edge.to) && is_supported(forest, i);
    return accepted;
  }

 private:
  MotionForest plant() const { return {edges_, motions_, tree_edges_}; }

  /// Says whether two loops between the same two trees are consistent.
  bool agree(const MotionForest& forest, std::size_t a, std::size_t b) const {
    const PoseGraphEdge &first = edges_[a], &second = edges_[b];
    const bool same_way = forest.tree(first.from) == forest.tree(second.from);
    const int from = same_way ? second.from : second.to, to = same_way ? second.to : second.from;
    UncertainMotion predicted =
        compose(compose(forest.path(from, first.from), motions_[a]), forest.path(first.to, to));
    if (same_way) return mismatch(predicted, motions_[b], scale_sigma_) <= kMaxMismatch;
    const UncertainMotion nothing = compose(predicted, motions_[b]);  // a closed cycle
    return mismatch({}, nothing, scale_sigma_) <= kMaxMismatch;
  }

  /// Joins trials by loops until no two trials have enough evidence; returns the resulting forest.
  MotionForest join_trials() {
    MotionForest forest = plant();
    while (join_components(forest)) forest = plant();
    return forest;
  }

  /// Adds the best loop between each two components that have enough evidence for one. Returns false when
  /// there is none.
  bool join_components(const MotionForest& forest) {
    std::map<std::pair<int, int>, std::vector<std::size_t>> between;
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const int a = forest.tree(edges_[i].from), b = forest.tree(edges_[i].to);
      if (a != b) between[std::minmax(a, b)].push_back(i);
    }
    std::vector<Agreement> found;
    for (auto& [components, loops] : between) {
      const Agreement most = most_agreed(forest, thinned(loops));
      if (most.loops > 1 || !edges_[most.seed].tentative) found.push_back(most);
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const Agreement& a, const Agreement& b) { return a.loops > b.loops; });
    UnionFind joined(forest.nodes());
    for (const Agreement& agreement : found) {
      const PoseGraphEdge& seed = edges_[agreement.seed];
      const int a = forest.tree(seed.from), b = forest.tree(seed.to);
      if (joined.root(a) == joined.root(b)) continue;
      joined.join(a, b);
      tree_edges_.push_back(agreement.seed);
    }
    return !found.empty();
  }

  std::vector<std::size_t> thinned(std::vector<std::size_t> loops) const {
    std::stable_sort(loops.begin(), loops.end(), [&](std::size_t a, std::size_t b) {
      return std::pair(edges_[a].to, edges_[a].from) < std::pair(edges_[b].to, edges_[b].from);
    });
    std::vector<std::size_t> result;
    const std::size_t step = (loops.size() + kMaxCompared - 1) / kMaxCompared;
    for (std::size_t i = 0; i < loops.size(); i += step) result.push_back(loops[i]);
    return result;
  }

  Agreement most_agreed(const MotionForest& forest, const std::vector<std::size_t>& loops) const {
    Agreement most;
    for (const std::size_t a : loops) {
      const auto agreeing =
          std::ranges::count_if(loops, [&](std::size_t b) { return a == b || agree(forest, a, b); });
      if (agreeing > most.loops) most = {a, agreeing};
    }
    return most;
  }

  /// Says whether the tree path between a loop's ends agrees with the loop.
  bool is_supported(const MotionForest& forest, std::size_t loop) const {
    return mismatch(forest.path(edges_[loop].from, edges_[loop].to), motions_[loop], scale_sigma_) <=
           kMaxMismatch;
  }

  const std::vector<PoseGraphEdge>& edges_;
  const double scale_sigma_;
  std::vector<UncertainMotion> motions_;  // The motion of every edge.
  // Indices of odometry edges and of the loops that join their trees.
  std::vector<std::size_t> tree_edges_;
};

}  // namespace

std::vector<bool> consistent_edges(const std::vector<PoseGraphEdge>& edges, double gradient_scale_sigma) {
  if (!(gradient_scale_sigma >= 0))
    throw Error("loop consistency: gradient_scale_sigma must not be negative");
  return Consistency(edges, gradient_scale_sigma).run();
}

double robust_cost(double residual, double scale) {
  const double kept = std::min(residual, kMaxMismatch);
  return scale * scale * std::log1p(kept * kept / (scale * scale));
}

double robust_weight(double residual, double scale) {
  return residual > kMaxMismatch ? 0.0 : 1.0 / (1.0 + residual * residual / (scale * scale));
}

std::vector<double> backend::detail::kernel_widenings(double widest) {
  constexpr double kNarrowing = 4.0;
  std::vector<double> widenings;
  for (double widening = widest; widening > 1; widening /= kNarrowing) widenings.push_back(widening);
  widenings.push_back(1);
  return widenings;
}

bool backend::detail::is_outlier(EdgeKind kind, double residual) {
  return kind == EdgeKind::loop && residual > kMaxMismatch;
}

}  // namespace gelslam
