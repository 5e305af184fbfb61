#pragma once

#include <vector>

#include "gelslam/backend/uncertain_motion.hpp"

namespace gelslam::backend::detail {

/// Difference of two independent measurements of one motion, in standard deviations (6 degrees of freedom).
double mismatch(const UncertainMotion& a, const UncertainMotion& b, double gradient_scale_sigma);

/// Spanning trees of the edges. The motion between two nodes of one tree is found in logarithmic time. Nodes
/// are numbered from 0; an edge that would close a cycle is left out.
class MotionForest {
 public:
  struct Edge {
    int from = 0, to = 0;
    const UncertainMotion* motion = nullptr;
  };

  MotionForest(int nodes, const std::vector<Edge>& edges);

  int tree(int node) const { return at(node).tree; }
  /// Both nodes must be of one tree.
  UncertainMotion path(int from, int to) const;

 private:
  struct Node {
    int tree = -1, parent = -1, jump = -1, depth = 0;
    Pose root_T_node = Pose::Identity();
    // Of root_T_node as a left perturbation: there errors of the edges on the way simply add up.
    Matrix6d covariance = Matrix6d::Zero();
    MotionByScale by_scale = MotionByScale::Zero();
  };

  const Node& at(int node) const { return nodes_[static_cast<std::size_t>(node)]; }
  void attach(int node, int parent, const Edge& edge);
  int common_ancestor(int a, int b) const;

  std::vector<Node> nodes_;
};

}  // namespace gelslam::backend::detail
