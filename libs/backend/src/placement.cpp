#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "gelslam/core/index.hpp"
#include "motion_forest.hpp"
#include "whitened_graph.hpp"
#include "gelslam/core/ablated.hpp"

namespace gelslam::backend::detail {
namespace {

// Initial poses contradict an edge above this many standard deviations. Drift that a solve can correct is
// below it.
constexpr double kContradiction = 50.0;

class Placement {
 public:
  Placement(const std::vector<WhitenedEdge>& edges, std::vector<NodeState>& nodes)
      : edges_(edges), nodes_(nodes), pieces_(static_cast<int>(nodes.size())), components_(pieces_) {
    for (const WhitenedEdge& edge : edges_) {
      components_.join(edge.from, edge.to);
      if (edge.kind == EdgeKind::odometry && residual(edge) < kContradiction)
        pieces_.join(edge.from, edge.to);
    }
    members_.resize(nodes.size());
    links_of_piece_.resize(nodes.size());
    for (int node = 0; node < static_cast<int>(nodes.size()); ++node)
      members_[index(pieces_.root(node))].push_back(node);
    for (const WhitenedEdge& edge : edges_) {
      const int a = pieces_.root(edge.from), b = pieces_.root(edge.to);
      if (a == b) continue;
      links_of_piece_[index(a)].push_back(&edge);
      links_of_piece_[index(b)].push_back(&edge);
    }
  }

  void run() {
    priority_.assign(nodes_.size(), {0, 0});
    placed_.assign(nodes_.size(), false);
    for (int node = 0; node < static_cast<int>(nodes_.size()); ++node)
      if (components_.root(node) == node) mark_placed(pieces_.root(node));
    while (!waiting_.empty()) {
      const int piece = std::get<2>(*waiting_.begin());
      waiting_.erase(waiting_.begin());
      move_piece(piece);
      mark_placed(piece);
    }
  }

 private:
  double residual(const WhitenedEdge& edge) const {
    return residual_norm(edge, nodes_[index(edge.from)], nodes_[index(edge.to)]);
  }

  // Sorted so that the piece with most odometry links, then most loops, then the smallest id is first.
  using Waiting = std::tuple<int, int, int>;
  Waiting entry(int piece) const {
    return {-priority_[index(piece)].first, -priority_[index(piece)].second, piece};
  }

  void mark_placed(int piece) {
    placed_[index(piece)] = true;
    for (const WhitenedEdge* link : links_of_piece_[index(piece)]) {
      const int a = pieces_.root(link->from), b = pieces_.root(link->to);
      const int other = a == piece ? b : a;
      if (placed_[index(other)]) continue;
      waiting_.erase(entry(other));
      auto& [odometry, loops] = priority_[index(other)];
      ++(link->kind == EdgeKind::odometry ? odometry : loops);
      waiting_.insert(entry(other));
    }
  }

  // The rigid motion of the waiting piece that makes `link` hold exactly.
  Pose proposal(const WhitenedEdge& link) {
    Pose from_T_to = Pose::Identity();
    from_T_to.linear() = link.rotation.toRotationMatrix();
    from_T_to.translation() = link.translation_mm;
    const Pose map_T_from = to_pose(nodes_[index(link.from)]), map_T_to = to_pose(nodes_[index(link.to)]);
    return placed_[index(pieces_.root(link.from))] ? map_T_from * from_T_to * map_T_to.inverse()
                                                   : map_T_to * from_T_to.inverse() * map_T_from.inverse();
  }

  double residual_after(const WhitenedEdge& link, const Pose& motion) {
    NodeState from = nodes_[index(link.from)], to = nodes_[index(link.to)];
    NodeState& moved = placed_[index(pieces_.root(link.from))] ? to : from;
    moved = to_state(motion * to_pose(moved));
    return residual_norm(link, from, to);
  }

  // Saturating: a false link costs the same however wrong it is.
  double disagreement(const std::vector<const WhitenedEdge*>& links, const Pose& motion) {
    double sum = 0;
    for (const WhitenedEdge* link : links)
      sum += std::log1p(std::pow(residual_after(*link, motion) / kContradiction, 2));
    return sum;
  }

  void move_piece(int piece) {
    std::vector<const WhitenedEdge*> links;  // to what is in place already
    for (const WhitenedEdge* link : links_of_piece_[index(piece)])
      if (placed_[index(pieces_.root(link->from))] || placed_[index(pieces_.root(link->to))])
        links.push_back(link);
    const auto agrees = [this](const WhitenedEdge* link) { return residual(*link) < kContradiction; };
    if (2 * std::count_if(links.begin(), links.end(), agrees) > static_cast<std::ptrdiff_t>(links.size()))
      return;

    std::stable_partition(links.begin(), links.end(),
                          [](auto* link) { return link->kind == EdgeKind::odometry; });
    Pose best = Pose::Identity();
    double best_disagreement = disagreement(links, best);
    const std::size_t step = (links.size() + kMaxCompared - 1) / kMaxCompared;
    for (std::size_t i = 0; i < links.size(); i += step) {
      const Pose motion = proposal(*links[i]);
      const double d = disagreement(links, motion);
      if (d < best_disagreement) {
        best = motion;
        best_disagreement = d;
      }
    }
    for (const int node : members_[index(piece)])
      nodes_[index(node)] = to_state(best * to_pose(nodes_[index(node)]));
  }

  const std::vector<WhitenedEdge>& edges_;
  std::vector<NodeState>& nodes_;
  UnionFind pieces_, components_;
  std::vector<std::vector<int>> members_;                         // of a piece, by its root
  std::vector<std::vector<const WhitenedEdge*>> links_of_piece_;  // edges that leave a piece
  std::vector<std::pair<int, int>> priority_;  // odometry and loop links to what is in place
  std::vector<bool> placed_;
  std::set<Waiting> waiting_;
};

}  // namespace

void place_pieces(const std::vector<WhitenedEdge>& edges, std::vector<NodeState>& nodes) {
  if (!ablated("placement")) Placement(edges, nodes).run();
}

}  // namespace gelslam::backend::detail
