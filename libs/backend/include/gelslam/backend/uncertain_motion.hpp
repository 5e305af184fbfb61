#pragma once

#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/core/uncertain_pose.hpp"

namespace gelslam {

/// The gradient scale has four factors, F = ((xx, xy), (yx, yy)) along the sensor's axes, stored in the order
/// xx, xy, yx, yy. They correct the slopes that the gradient model reads: true slope = (I - F) * read slope.
/// They are deviations from 1 and not ratios, so all zeros mean no correction.
inline constexpr int kScaleTerms = 4;
using MotionByScale = Eigen::Matrix<double, 6, kScaleTerms>;

/// Returns the derivative of the motion that an edge measures with respect to the four factors, as a right
/// perturbation (6x4). The rotation of the motion is split into a twist about z, followed by a tilt (rx, ry,
/// 0). The twist does not depend on the factors; the tilt becomes (rx - yy rx + yx ry, ry - xx ry + xy rx,
/// 0). The center of the shared contact stays in contact: its depth in each of the two frames is
/// multiplied by 1 - (xx + yy) / 2, and its x and y do not change. The method is not in the paper.
MotionByScale motion_by_gradient_scale(const PoseGraphEdge& edge);

/// Returns the four factors as unknowns that all edges share. `sigma` is the prior standard deviation of xx
/// and yy.
SharedUnknowns gradient_scale_unknowns(const std::vector<PoseGraphEdge>& edges, double sigma);

/// Solves the pose graph twice, without and with the gradient scale as shared unknowns. The second solution
/// is returned only if it lowers the robust cost by at least a fifth; otherwise the first one is returned,
/// without shared unknowns. The derivatives of an edge with respect to the scale are taken at the motion of
/// the first solution. Taken at the measured motion, they would contain the same noise as the residual, which
/// biases the scale toward flatter slopes with every loop over ground that is already mapped (errors in
/// variables). See solve_pose_graph() for the initial poses and the errors thrown. The method is not in the
/// paper.
PoseGraphSolution solve_with_gradient_scale(const std::map<int, Pose>& initial_map_T_node,
                                            const std::vector<PoseGraphEdge>& edges,
                                            const PoseGraphOptions& options, double sigma);

/// Covariance of the four factors.
using ScaleCovariance = Eigen::Matrix<double, kScaleTerms, kScaleTerms>;
/// Returns the prior covariance of the four factors. `sigma` is the prior standard deviation of xx and yy.
ScaleCovariance prior_scale_covariance(double sigma);

/// A motion with two kinds of uncertainty: noise of its own, and the error by the gradient scale, which is
/// common to all measurements of a sensor and therefore must not be treated as independent between them.
struct UncertainMotion {
  UncertainPose from_T_to;
  /// Derivative of the motion with respect to the gradient scale's factors, as a right perturbation.
  MotionByScale by_scale = MotionByScale::Zero();

  /// Returns the covariance of the motion by noise and gradient scale together. `scale` is the covariance of
  /// the factors.
  Matrix6d total_covariance(const ScaleCovariance& scale) const;
  /// Returns the motion corrected by the given factors. An empty vector means no correction.
  UncertainMotion corrected(const Eigen::VectorXd& factors) const;
};

/// Returns the motion that an edge measures, with its covariance. The weak prior of overlapping frames
/// (kOverlapSigmaRad, kOverlapSigmaMm) bounds the covariance along directions in which the edge has no
/// information.
UncertainMotion uncertain_motion(const PoseGraphEdge& edge);

/// Says whether an edge determines the relative pose of its two surfaces well enough to align them: two
/// standard deviations of the contact's center are below 5 mm, and two standard deviations of the rotation
/// are below 20 degrees. For comparison, a contact is about 8 mm wide.
bool constrains_pose(const PoseGraphEdge& edge);

/// Composes two independently measured motions a_T_b and b_T_c to a_T_c.
UncertainMotion compose(const UncertainMotion& a, const UncertainMotion& b);

/// Returns a function that estimates the motion between two nodes of a graph with its covariance. It composes
/// the edges along one short path between the nodes and needs no solve. The function returns nothing where no
/// path exists; edges marked in `outlier` (PoseGraphSolution::edge_outlier of these edges) are not used. The
/// covariance includes that of a gradient scale common to all edges, with the prior standard deviation
/// `gradient_scale_sigma`. Throws Error when `outlier` and `edges` differ in size.
std::function<std::optional<UncertainPose>(int from, int to)> motions_between(
    const std::vector<PoseGraphEdge>& edges, const std::vector<bool>& outlier, double gradient_scale_sigma);

}  // namespace gelslam
