#include "motion_forest.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace gelslam::backend::detail {

double mismatch(const UncertainMotion& a, const UncertainMotion& b, double gradient_scale_sigma) {
  const Vector6d error = se3_log(a.from_T_to.pose.inverse() * b.from_T_to.pose);
  const UncertainMotion difference{{Pose::Identity(), a.from_T_to.covariance + b.from_T_to.covariance},
                                   b.by_scale - a.by_scale};
  const Matrix6d covariance = difference.total_covariance(gradient_scale_sigma);
  return std::sqrt(std::max(error.dot(covariance.ldlt().solve(error)), 0.0));  // NaN stays NaN
}

MotionForest::MotionForest(int nodes, const std::vector<Edge>& edges)
    : nodes_(static_cast<std::size_t>(nodes)) {
  std::vector<std::vector<const Edge*>> edges_of(nodes_.size());
  for (const Edge& edge : edges) {
    edges_of[static_cast<std::size_t>(edge.from)].push_back(&edge);
    edges_of[static_cast<std::size_t>(edge.to)].push_back(&edge);
  }
  std::vector<int> reached;
  for (int root = 0; root < nodes; ++root) {
    if (tree(root) >= 0) continue;
    Node& node = nodes_[static_cast<std::size_t>(root)];
    node.tree = node.jump = root;
    reached.assign(1, root);
    for (std::size_t next = 0; next < reached.size(); ++next)
      for (const Edge* edge : edges_of[static_cast<std::size_t>(reached[next])]) {
        const int other = edge->from == reached[next] ? edge->to : edge->from;
        if (tree(other) >= 0) continue;
        attach(other, reached[next], *edge);
        reached.push_back(other);
      }
  }
}

// An edge's noise is a perturbation at its `to` end. Transported to the root it is the same for both
// directions of the edge, except for the sign.
void MotionForest::attach(int child, int parent, const Edge& edge) {
  const Node& above = at(parent);
  const bool forward = edge.to == child;
  const Pose& measured = edge.motion->from_T_to.pose;
  Node& node = nodes_[static_cast<std::size_t>(child)];
  node.tree = above.tree;
  node.parent = parent;
  node.depth = above.depth + 1;
  // Skew-binary jump pointers: any ancestor is found in logarithmic time.
  const Node& jump = at(above.jump);
  node.jump = above.depth - jump.depth == jump.depth - at(jump.jump).depth ? jump.jump : parent;
  node.root_T_node = normalized(above.root_T_node * (forward ? measured : Pose(measured.inverse())));
  const Matrix6d to_root = adjoint(forward ? node.root_T_node : above.root_T_node);
  node.covariance = above.covariance + to_root * edge.motion->from_T_to.covariance * to_root.transpose();
  node.by_scale = above.by_scale + (forward ? 1.0 : -1.0) * to_root * edge.motion->by_scale;
}

int MotionForest::common_ancestor(int a, int b) const {
  if (at(a).depth < at(b).depth) std::swap(a, b);
  while (at(a).depth > at(b).depth) a = at(at(a).jump).depth >= at(b).depth ? at(a).jump : at(a).parent;
  while (a != b) {
    const bool far = at(a).jump != at(b).jump;
    a = far ? at(a).jump : at(a).parent;
    b = far ? at(b).jump : at(b).parent;
  }
  return a;
}

UncertainMotion MotionForest::path(int from, int to) const {
  const Node &a = at(from), &b = at(to), &top = at(common_ancestor(from, to));
  const Matrix6d to_end = adjoint(b.root_T_node.inverse());
  return {{a.root_T_node.inverse() * b.root_T_node,
           to_end * (a.covariance + b.covariance - 2 * top.covariance) * to_end.transpose()},
          to_end * (b.by_scale - a.by_scale)};
}

}  // namespace gelslam::backend::detail
