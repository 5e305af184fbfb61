#include <Eigen/Cholesky>

#include "gelslam/core/index.hpp"
#include "whitened_graph.hpp"

namespace gelslam::backend::detail {
namespace {

constexpr double kPulledSigmas = 0.05;  // numerics: what is left by a solve that has converged

struct Pull {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
};

// Gauss-Newton blocks per node, with the derivative of the error taken at zero error: good to the size of the
// error in radians, and only used to decide where to look.
std::vector<Pull> pulls(const std::vector<WhitenedEdge>& edges, const std::vector<NodeState>& nodes,
                        double loop_loss_scale) {
  std::vector<Pull> result(nodes.size());
  for (const WhitenedEdge& edge : edges) {
    const NodeState &from = nodes[index(edge.from)], &to = nodes[index(edge.to)];
    const Vector6d residual = whitened_error(edge, from.data(), to.data());
    const double weight = edge.kind == EdgeKind::loop ? robust_weight(residual.norm(), loop_loss_scale) : 1.0;
    const Matrix6d by_to = edge.whitening;
    const Matrix6d by_from = -edge.whitening * adjoint(to_pose(to).inverse() * to_pose(from));
    result[index(edge.to)].hessian += weight * by_to.transpose() * by_to;
    result[index(edge.to)].gradient += weight * by_to.transpose() * residual;
    result[index(edge.from)].hessian += weight * by_from.transpose() * by_from;
    result[index(edge.from)].gradient += weight * by_from.transpose() * residual;
  }
  return result;
}

void grow(const std::vector<WhitenedEdge>& edges, int rings, std::vector<bool>& seeds) {
  for (int ring = 0; ring < rings; ++ring) {
    std::vector<bool> grown = seeds;
    for (const WhitenedEdge& edge : edges)
      if (seeds[index(edge.from)] || seeds[index(edge.to)])
        grown[index(edge.from)] = grown[index(edge.to)] = true;
    seeds = std::move(grown);
  }
}

}  // namespace

bool grow_active_region(const std::vector<WhitenedEdge>& edges, const std::vector<NodeState>& nodes,
                        double loop_loss_scale, int rings, std::vector<bool>& region) {
  const std::vector<Pull> of_node = pulls(edges, nodes, loop_loss_scale);
  std::vector<bool> seeds(nodes.size(), false);
  bool found = false;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (region[i] || of_node[i].gradient.isZero(0)) continue;
    const double decrement = of_node[i].gradient.dot(of_node[i].hessian.ldlt().solve(of_node[i].gradient));
    seeds[i] = decrement > kPulledSigmas * kPulledSigmas;
    found = found || seeds[i];
  }
  grow(edges, rings, seeds);
  for (std::size_t i = 0; i < nodes.size(); ++i) region[i] = region[i] || seeds[i];
  return found;
}

}  // namespace gelslam::backend::detail
