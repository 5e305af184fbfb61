#pragma once

#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/core/uncertain_pose.hpp"

namespace gelslam {

/// The four factors of true slope (gx, gy) = (I - F) * read slope, with F = ((xx, xy), (yx, yy)) along the
/// sensor's axes, in the order xx, xy, yx, yy (0: no correction). xx and yy are the gradient scale.
inline constexpr int kScaleTerms = 4;
using MotionByScale = Eigen::Matrix<double, 6, kScaleTerms>;

/// Returns how the motion that an edge measures changes, as a right perturbation, when the slopes it was
/// measured from are corrected. The rotation of the measured motion is split into a tilt (rx, ry, 0) after a
/// twist about z. The correction does not change the twist; the tilt becomes (rx - yy rx + yx ry, ry - xx ry
/// + xy rx, 0). The shared center, whose depth is scaled by the mean of xx and yy in either frame, stays the
/// place where the frames touch: slopes that are read too steep change tilts and depths, but not x and y.
/// Source: own.
MotionByScale motion_by_gradient_scale(const PoseGraphEdge& edge);

/// Returns the factors as unknowns that all edges share, where the prior standard deviation of the gradient
/// scale is `sigma`.
SharedUnknowns gradient_scale_unknowns(const std::vector<PoseGraphEdge>& edges, double sigma);

/// Solves for the poses and, where it explains a good part of what loops contradict, for the gradient scale;
/// else for the poses alone, without shared unknowns. The derivatives of an edge by the scale are taken at
/// the motion that all edges agree on without it. At the measured motion, noise would be in the residual and
/// in the derivative, and each loop over known ground would make slopes flatter (errors in variables).
/// Initial poses and errors: see solve_pose_graph(). Source: own.
PoseGraphSolution solve_with_gradient_scale(const std::map<int, Pose>& initial_map_T_node,
                                            const std::vector<PoseGraphEdge>& edges,
                                            const PoseGraphOptions& options, double sigma);

/// Covariance of the factors.
using ScaleCovariance = Eigen::Matrix<double, kScaleTerms, kScaleTerms>;
/// Returns the covariance of the factors before anything was measured, where the prior standard deviation of
/// the gradient scale is `sigma`.
ScaleCovariance prior_scale_covariance(double sigma);

/// A motion and its uncertainty: its noise, and the gradient scale, a cause common to all measurements.
struct UncertainMotion {
  UncertainPose from_T_to;
  /// How the motion changes, as a right perturbation, when the gradient scale is corrected.
  MotionByScale by_scale = MotionByScale::Zero();

  /// Returns the covariance of noise and gradient scale together.
  Matrix6d total_covariance(const ScaleCovariance& scale) const;
  /// Returns the motion with slopes corrected by the factors, or as it is for no factors.
  UncertainMotion corrected(const Eigen::VectorXd& factors) const;
};

/// Returns the motion that an edge measures. Along directions without information, overlapping frames are
/// known to a radian and to the sensor's width.
UncertainMotion uncertain_motion(const PoseGraphEdge& edge);

/// Says whether an edge tells where its surfaces lie on each other: two standard deviations are below 5 mm,
/// where they touch, and 20 degrees. A contact is some 8 mm wide.
bool constrains_pose(const PoseGraphEdge& edge);

/// Composes a_T_b and b_T_c, measured independently, to a_T_c.
UncertainMotion compose(const UncertainMotion& a, const UncertainMotion& b);

/// Returns how precisely a graph's edges determine the motion between two of its nodes: by the edges of one
/// short path between them, without a solve; nothing where none lead. What is an `outlier`
/// (PoseGraphSolution::edge_outlier of these edges) leads nowhere. A gradient scale common to all edges
/// counts (see pose_graph.hpp).
std::function<std::optional<UncertainPose>(int from, int to)> motions_between(
    const std::vector<PoseGraphEdge>& edges, const std::vector<bool>& outlier, double gradient_scale_sigma);

}  // namespace gelslam
