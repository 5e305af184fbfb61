#include "loop_layers.hpp"

#include <algorithm>
#include <bitset>
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

// Of the loops between two pieces, this many are compared with each other, evenly chosen along the scan:
// enough to see which place most agree on.
constexpr int kMaxCompared = 24;  // speed

using LoopSet = std::bitset<kMaxCompared>;
using Agreements = std::vector<LoopSet>;  // of each loop with all of them, itself included

/// The largest of `candidates` that all agree with each other; of equal ones, that with the earliest loops.
/// (Branch and bound after Carraghan & Pardalos 1990.)
LoopSet largest_clique(const Agreements& agreed, LoopSet candidates, std::size_t more_than = 0) {
  LoopSet best;
  for (std::size_t i = 0; i < agreed.size(); ++i) {
    if (candidates.count() <= more_than) break;
    if (!candidates[i]) continue;
    candidates.reset(i);
    const LoopSet rest =
        largest_clique(agreed, candidates & agreed[i], std::max<std::size_t>(more_than, 1) - 1);
    if (rest.count() + 1 <= more_than) continue;
    best = rest;
    best.set(i);
    more_than = best.count();
  }
  return best;
}

/// The largest set of loops between two pieces that agree.
struct Agreement {
  std::size_t seed = 0;  // the edge of it that most others agree with
  int loops = 0, rival_loops = 0;
  bool enough = false;
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

  /// Whether two loops between the same two trees are consistent.
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

  /// Loops join trials until no two trials have enough evidence.
  MotionForest join_trials() {
    MotionForest forest = plant();
    while (join_pieces(forest)) forest = plant();
    return forest;
  }

  /// Adds the best link between each two pieces with enough evidence; false when there are none.
  bool join_pieces(const MotionForest& forest) {
    std::map<std::pair<int, int>, std::vector<std::size_t>> between;
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const int a = forest.tree(edges_[i].from), b = forest.tree(edges_[i].to);
      if (a != b) between[std::minmax(a, b)].push_back(i);
    }
    std::vector<Agreement> found;
    for (auto& [pieces, loops] : between) {
      const Agreement agreement = largest_agreement(forest, thinned(loops));
      if (agreement.enough && agreement.loops > agreement.rival_loops) found.push_back(agreement);
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

  /// The largest set of loops that all agree with each other, and how many agree on another place: with one
  /// that contradicts most of the set.
  Agreement largest_agreement(const MotionForest& forest, const std::vector<std::size_t>& loops) const {
    const std::size_t n = loops.size();
    LoopSet all;
    for (std::size_t i = 0; i < n; ++i) all.set(i);
    Agreements agreed(n, all);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < i; ++j) agreed[i][j] = agreed[j][i] = agree(forest, loops[i], loops[j]);
    const LoopSet best = largest_clique(agreed, all);
    std::size_t seed = 0, rival_loops = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (best[i] && (!best[seed] || agreed[i].count() > agreed[seed].count())) seed = i;
      if (2 * (agreed[i] & best).count() < best.count())
        rival_loops = std::max(rival_loops, largest_clique(agreed, agreed[i]).count());
    }
    return {loops[seed], static_cast<int>(best.count()), static_cast<int>(rival_loops), enough(loops, best)};
  }

  bool enough(const std::vector<std::size_t>& loops, const LoopSet& chosen) const {
    for (std::size_t i = 0; i < loops.size(); ++i) {
      if (!chosen[i]) continue;
      const PoseGraphEdge& a = edges_[loops[i]];
      if (!a.tentative) return true;
      for (std::size_t j = 0; j < i; ++j) {
        const PoseGraphEdge& b = edges_[loops[j]];
        if (chosen[j] && a.from != b.from && a.to != b.to && a.from != b.to && a.to != b.from) return true;
      }
    }
    return false;
  }

  /// Whether the path between a loop's ends says the same.
  bool is_supported(const MotionForest& forest, std::size_t loop) const {
    return mismatch(forest.path(edges_[loop].from, edges_[loop].to), motions_[loop], scale_sigma_) <=
           kMaxMismatch;
  }

  const std::vector<PoseGraphEdge>& edges_;
  const double scale_sigma_;
  std::vector<UncertainMotion> motions_;  // of the edges
  std::vector<std::size_t> tree_edges_;   // odometry, and loops that join its pieces
};

}  // namespace

std::vector<bool> consistent_edges(const std::vector<PoseGraphEdge>& edges, double gradient_scale_sigma) {
  if (!(gradient_scale_sigma >= 0))
    throw Error("loop consistency: gradient_scale_sigma must not be negative");
  return Consistency(edges, gradient_scale_sigma).run();
}

namespace {

/// The motion of the piece that holds one end of `link` (`to`, or else `from`) which makes the link hold
/// exactly.
Pose motion_onto(const WhitenedEdge& link, bool moves_to, const std::vector<NodeState>& nodes) {
  Pose from_T_to = Pose::Identity();
  from_T_to.linear() = link.rotation.toRotationMatrix();
  from_T_to.translation() = link.translation_mm;
  const Pose map_T_from = to_pose(nodes[index(link.from)]), map_T_to = to_pose(nodes[index(link.to)]);
  return moves_to ? map_T_from * from_T_to * map_T_to.inverse()
                  : map_T_to * from_T_to.inverse() * map_T_from.inverse();
}

/// Moves the nodes of a piece, ascending, onto one of its links to other pieces, if more of them hold there
/// than where it is.
void move_to_best_place(const std::vector<const WhitenedEdge*>& links, const std::vector<int>& piece,
                        std::vector<NodeState>& nodes) {
  const auto moves = [&](int node) { return std::binary_search(piece.begin(), piece.end(), node); };
  const auto links_that_hold = [&](const Pose& motion) {
    const auto moved = [&](int node) {
      return moves(node) ? to_state(motion * to_pose(nodes[index(node)])) : nodes[index(node)];
    };
    return std::count_if(links.begin(), links.end(), [&](const WhitenedEdge* link) {
      return residual_norm(*link, moved(link->from), moved(link->to)) <= kMaxMismatch;
    });
  };
  Pose best = Pose::Identity();
  auto most = links_that_hold(best);
  const std::size_t step = (links.size() + kMaxCompared - 1) / kMaxCompared;
  for (std::size_t i = 0; i < links.size(); i += step) {
    const Pose motion = motion_onto(*links[i], moves(links[i]->to), nodes);
    const auto holding = links_that_hold(motion);
    if (holding > most) most = holding, best = motion;
  }
  for (const int node : piece) nodes[index(node)] = to_state(best * to_pose(nodes[index(node)]));
}

}  // namespace

void backend::detail::place_pieces(const std::vector<WhitenedEdge>& edges, std::vector<NodeState>& nodes) {
  UnionFind pieces(static_cast<int>(nodes.size())), components = pieces;
  for (const WhitenedEdge& edge : edges) {
    components.join(edge.from, edge.to);
    if (edge.kind == EdgeKind::odometry) pieces.join(edge.from, edge.to);
  }
  std::vector<std::vector<const WhitenedEdge*>> links(nodes.size());  // that leave a piece, by its root
  for (const WhitenedEdge& edge : edges)
    for (const int node : {edge.from, edge.to})
      if (pieces.root(edge.from) != pieces.root(edge.to)) links[index(pieces.root(node))].push_back(&edge);
  std::vector<std::vector<int>> members(nodes.size());  // of a piece, by its root
  std::vector<bool> placed(nodes.size(), false);
  std::vector<int> reached;
  for (int node = 0; node < static_cast<int>(nodes.size()); ++node) {
    members[index(pieces.root(node))].push_back(node);
    if (components.root(node) != node) continue;
    reached.push_back(pieces.root(node));
    placed[index(pieces.root(node))] = true;
  }
  for (std::size_t next = 0; next < reached.size(); ++next)
    for (const WhitenedEdge* link : links[index(reached[next])]) {
      const int piece = pieces.root(placed[index(pieces.root(link->to))] ? link->from : link->to);
      if (placed[index(piece)]) continue;
      std::vector<const WhitenedEdge*> to_placed;
      for (const WhitenedEdge* other : links[index(piece)])
        if (placed[index(pieces.root(other->from))] || placed[index(pieces.root(other->to))])
          to_placed.push_back(other);
      move_to_best_place(to_placed, members[index(piece)], nodes);
      placed[index(piece)] = true;
      reached.push_back(piece);
    }
}

double robust_cost(double residual, double scale) {
  const double kept = std::min(residual, kMaxMismatch);
  return scale * scale * std::log1p(kept * kept / (scale * scale));
}

double robust_weight(double residual, double scale) {
  return residual > kMaxMismatch ? 0.0 : 1.0 / (1.0 + residual * residual / (scale * scale));
}

std::vector<double> backend::detail::kernel_widenings(double widest) {
  constexpr double kNarrowing = 4.0;  // numerics
  std::vector<double> widenings;
  for (double widening = widest; widening > 1; widening /= kNarrowing) widenings.push_back(widening);
  widenings.push_back(1);
  return widenings;
}

bool backend::detail::is_outlier(EdgeKind kind, double residual) {
  return kind == EdgeKind::loop && residual > kMaxMismatch;
}

}  // namespace gelslam
