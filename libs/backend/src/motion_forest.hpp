#pragma once

#include <map>
#include <vector>

#include "gelslam/backend/uncertain_motion.hpp"

namespace gelslam::backend::detail {

/// Returns the Mahalanobis distance between two independent measurements of one motion, in standard
/// deviations (6 degrees of freedom).
double mismatch(const UncertainMotion& a, const UncertainMotion& b, double gradient_scale_sigma);

/// Spanning trees over some edges of a graph, and the motions between the nodes of each tree. Edges that
/// would close a cycle are left out.
class MotionForest {
 public:
  /// Builds the trees from the edges with the indices `chosen`, in this order. `motions` holds the motion of
  /// every edge in `edges`.
  MotionForest(const std::vector<PoseGraphEdge>& edges, const std::vector<UncertainMotion>& motions,
               const std::vector<std::size_t>& chosen);

  /// Returns the number of nodes. Trees are numbered by their root, so tree numbers lie between 0 and nodes()
  /// - 1.
  int nodes() const { return static_cast<int>(nodes_.size()); }
  /// Returns the number of the tree that contains a keyframe, or -1 if no edge of the graph, chosen or not,
  /// names the keyframe.
  int tree(int keyframe) const {
    const auto node = node_of_.find(keyframe);
    return node == node_of_.end() ? -1 : at(node->second).tree;
  }
  /// Returns the motion between two keyframes of the same tree.
  UncertainMotion path(int from, int to) const;

 private:
  struct Node {
    int tree = -1, parent = -1, depth = 0;
    Pose root_T_node = Pose::Identity();
    // Covariance of root_T_node as a left perturbation. In this form the errors of the edges along the path
    // simply add up.
    Matrix6d covariance = Matrix6d::Zero();
    MotionByScale by_scale = MotionByScale::Zero();
  };

  const Node& at(int node) const { return nodes_[static_cast<std::size_t>(node)]; }
  void attach(int child, int parent, bool forward, const UncertainMotion& motion);
  int common_ancestor(int a, int b) const;

  std::map<int, int> node_of_;  // Node index by keyframe id.
  std::vector<Node> nodes_;
};

}  // namespace gelslam::backend::detail
