// Motions between any two keyframes along chosen edges of the pose graph, with their covariances.
//
// A breadth-first search over the chosen edges, from each keyframe that no tree contains yet, gives spanning
// trees. Each node keeps its pose relative to the root and the covariance of that pose to first order, which
// is the sum of the covariances of the edges between root and node, each transported to the root by the
// adjoint. The motion between two nodes a and b is root_T_a^-1 * root_T_b. Its covariance is the sum of the
// covariances of both nodes, minus twice that of their lowest common ancestor, because the edges above the
// ancestor are in both paths and cancel. The gradient scale is the same for all edges, so the errors that
// it causes are not independent. Therefore the derivatives by it (by_scale) are added along the path, and not
// covariances.

#include "motion_forest.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "gelslam/core/index.hpp"

namespace gelslam::backend::detail {

double mismatch(const UncertainMotion& a, const UncertainMotion& b, double gradient_scale_sigma) {
  const Vector6d error = se3_log(a.from_T_to.pose.inverse() * b.from_T_to.pose);
  const UncertainMotion difference{{Pose::Identity(), a.from_T_to.covariance + b.from_T_to.covariance},
                                   b.by_scale - a.by_scale};
  const Matrix6d covariance = difference.total_covariance(prior_scale_covariance(gradient_scale_sigma));
  return std::sqrt(std::max(error.dot(covariance.ldlt().solve(error)), 0.0));  // std::max() keeps a NaN.
}

MotionForest::MotionForest(const std::vector<PoseGraphEdge>& edges,
                           const std::vector<UncertainMotion>& motions,
                           const std::vector<std::size_t>& chosen) {
  for (const PoseGraphEdge& edge : edges)
    for (const int keyframe : {edge.from, edge.to}) node_of_.try_emplace(keyframe, 0);
  int count = 0;
  for (auto& [keyframe, node] : node_of_) node = count++;
  nodes_.resize(index(count));
  std::vector<std::vector<std::size_t>> edges_of(nodes_.size());
  for (const std::size_t i : chosen)
    for (const int keyframe : {edges[i].from, edges[i].to})
      edges_of[index(node_of_.at(keyframe))].push_back(i);
  std::vector<int> reached;
  for (int root = 0; root < count; ++root) {
    if (at(root).tree >= 0) continue;
    nodes_[index(root)].tree = root;
    reached.assign(1, root);
    for (std::size_t next = 0; next < reached.size(); ++next)
      for (const std::size_t i : edges_of[index(reached[next])]) {
        const int from = node_of_.at(edges[i].from), to = node_of_.at(edges[i].to);
        const int other = from == reached[next] ? to : from;
        if (at(other).tree >= 0) continue;
        attach(other, reached[next], to == other, motions[i]);
        reached.push_back(other);
      }
  }
}

// The noise of an edge is a right perturbation, so it acts at the edge's `to` node. Transported to the root,
// it is the same for both directions of the edge, except for its sign.
void MotionForest::attach(int child, int parent, bool forward, const UncertainMotion& motion) {
  const Node& above = at(parent);
  const Pose& measured = motion.from_T_to.pose;
  Node& node = nodes_[index(child)];
  node.tree = above.tree;
  node.parent = parent;
  node.depth = above.depth + 1;
  node.root_T_node = normalized(above.root_T_node * (forward ? measured : Pose(measured.inverse())));
  const Matrix6d to_root = adjoint(forward ? node.root_T_node : above.root_T_node);
  node.covariance = above.covariance + to_root * motion.from_T_to.covariance * to_root.transpose();
  node.by_scale = above.by_scale + (forward ? 1.0 : -1.0) * to_root * motion.by_scale;
}

int MotionForest::common_ancestor(int a, int b) const {
  while (a != b) {
    int& deeper = at(a).depth > at(b).depth ? a : b;
    deeper = at(deeper).parent;
  }
  return a;
}

UncertainMotion MotionForest::path(int from, int to) const {
  const int start = node_of_.at(from), end = node_of_.at(to);
  const Node &a = at(start), &b = at(end), &top = at(common_ancestor(start, end));
  const Matrix6d to_end = adjoint(b.root_T_node.inverse());
  return {{a.root_T_node.inverse() * b.root_T_node,
           to_end * (a.covariance + b.covariance - 2 * top.covariance) * to_end.transpose()},
          to_end * (b.by_scale - a.by_scale)};
}

}  // namespace gelslam::backend::detail
