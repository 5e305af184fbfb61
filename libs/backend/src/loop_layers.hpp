#pragma once

#include <vector>

#include "whitened_graph.hpp"

// Tests of a loop, in this order, after verify() (in registration) has compared its two surfaces:
//   consistent_edges():
//   1. join_trials             a loop that is certain, or with which another one agrees, joins two trials
//   2. is_supported            a loop must agree with the path between its ends
//   solve_pose_graph():
//   3. robust_cost, _weight    a loop with a large residual gets a lower weight
//   4. kernel_widenings        loops with large residuals from accumulated drift can still be closed
//   5. is_outlier              a loop that still contradicts the graph has no weight
//   5. is_outlier              a loop that still does not fit has no weight
namespace gelslam::backend::detail {

/// Returns the factors by which the robust kernel is widened in successive solves (graduated non-convexity;
/// Blake & Zisserman 1987). After long drift a true loop has a residual as large as that of a false one, and
/// a robust kernel gives both little weight. The first kernel is `widest` times as wide, so that even the
/// loop with the largest residual is in its quadratic part; each further one is narrower by four, and the
/// last factor is 1. On the way true loops close and false ones lose their weight.
std::vector<double> kernel_widenings(double widest);

/// Says whether a loop's residual is beyond kMaxMismatch.
bool is_outlier(EdgeKind kind, double residual);

}  // namespace gelslam::backend::detail
