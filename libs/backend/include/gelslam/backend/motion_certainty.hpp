#pragma once

#include <memory>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"

namespace gelslam {

/// How well a graph's edges know the motion between two of its nodes: by the edges on one way from one to the
/// other with few steps, without a solve. A gradient scale common to all edges counts (see pose_graph.hpp).
class MotionCertainty {
 public:
  MotionCertainty(const std::vector<PoseGraphEdge>& edges, double gradient_scale_sigma);
  ~MotionCertainty();

  /// Standard deviation of the translation of from_T_to in its worst direction, mm; infinite where no edges
  /// lead.
  double sigma_mm(int from, int to) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace gelslam
