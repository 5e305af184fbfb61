#pragma once

#include <vector>

#include "gelslam/backend/pose_graph.hpp"

namespace gelslam {

/// How the motion that an edge measures changes, as a right perturbation, when the slopes it was measured
/// from are corrected: true slope = (1 - factor) * read slope, one factor along the sensor's x and one along
/// its y (0: no correction). Of the measured motion, with its rotation split into a tilt (rx, ry, 0) after a
/// twist about z, the correction leaves the tilt ((1 - fy) rx, (1 - fx) ry, 0) and the twist. The shared
/// center, whose depth is scaled by the mean of both in either frame, stays where the frames touch: slopes
/// read too steep tilt and deepen everything they measure, but leave x and y alone. Source: own.
Eigen::Matrix<double, 6, 2> motion_by_gradient_scale(const PoseGraphEdge& edge);

/// The two factors as unknowns that all edges share, each 0 +- sigma before the loops tell more.
SharedUnknowns gradient_scale_unknowns(const std::vector<PoseGraphEdge>& edges, double sigma);

}  // namespace gelslam
