#pragma once

#include <map>
#include <vector>

#include "gelslam/backend/uncertain_motion.hpp"

namespace gelslam::backend::detail {

/// Returns the difference of two independent measurements of one motion, in standard deviations (6 degrees of
/// freedom).
double mismatch(const UncertainMotion& a, const UncertainMotion& b, double gradient_scale_sigma);

/// Spanning trees of some edges of a graph, and the motions between the nodes of each. An edge that would
/// close a cycle is left out.
class MotionForest {
 public:
  /// Plants the trees of the edges that are `chosen`, in this order. `motions` are those of all edges.
  MotionForest(const std::vector<PoseGraphEdge>& edges, const std::vector<UncertainMotion>& motions,
               const std::vector<std::size_t>& chosen);

  /// Trees have numbers from 0 to below this.
  int nodes() const { return static_cast<int>(nodes_.size()); }
  /// Returns the number of a keyframe's tree; -1 where no edge of the graph, chosen or not, has it.
  int tree(int keyframe) const {
    const auto node = node_of_.find(keyframe);
    return node == node_of_.end() ? -1 : at(node->second).tree;
  }
  /// Returns the motion between two keyframes, which must be of one tree.
  UncertainMotion path(int from, int to) const;

 private:
  struct Node {
    int tree = -1, parent = -1, depth = 0;
    Pose root_T_node = Pose::Identity();
    // The covariance of root_T_node as a left perturbation, where the errors of the edges on the way simply
    // add up.
    Matrix6d covariance = Matrix6d::Zero();
    MotionByScale by_scale = MotionByScale::Zero();
  };

  const Node& at(int node) const { return nodes_[static_cast<std::size_t>(node)]; }
  void attach(int child, int parent, bool forward, const UncertainMotion& motion);
  int common_ancestor(int a, int b) const;

  std::map<int, int> node_of_;  // by keyframe id
  std::vector<Node> nodes_;
};

}  // namespace gelslam::backend::detail
