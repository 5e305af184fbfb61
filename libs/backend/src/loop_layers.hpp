#pragma once

#include <vector>

#include "whitened_graph.hpp"

// What a loop meets, in this order. Before, verify() (registration) has compared its two surfaces.
//   consistent_edges():
//   1. join_trials             a loop that is certain, or another one agrees with, joins two trials
//   2. is_supported            the way between a loop's ends says the same
//   solve_pose_graph():
//   3. robust_cost, _weight    a loop that does not fit pulls less
//   4. kernel_widenings        loops that drift has opened wide are closed
//   5. is_outlier              a loop that still does not fit has no weight
namespace gelslam::backend::detail {

/// Returns the widths of the kernel for graduated non-convexity. A robust kernel gives little weight to any
/// loop that drift has opened wide, true or false. Starting from a kernel `widest` times as wide, as wide as
/// the worst loop, and narrowing it, true loops close and false ones lose their weight. (Blake & Zisserman
/// 1987; schedule: own.)
std::vector<double> kernel_widenings(double widest);

/// Says whether a loop's residual is beyond kMaxMismatch.
bool is_outlier(EdgeKind kind, double residual);

}  // namespace gelslam::backend::detail
