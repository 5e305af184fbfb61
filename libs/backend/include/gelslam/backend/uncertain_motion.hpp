#pragma once

#include "gelslam/backend/pose_graph.hpp"

namespace gelslam {

/// A measured motion, with what is not known of it: noise, and what a gradient scale common to all
/// measurements does.
struct UncertainMotion {
  Pose from_T_to = Pose::Identity();
  Matrix6d covariance = Matrix6d::Zero();  ///< of the right perturbation (rad, mm)
  /// How the measurement changes when the gradient scale is corrected (motion_by_gradient_scale()). The
  /// correction is common to all measurements.
  Eigen::Matrix<double, 6, 2> by_scale = Eigen::Matrix<double, 6, 2>::Zero();

  /// Noise and gradient scale together; the scale is known to `gradient_scale_sigma`.
  Matrix6d covariance_with_scale(double gradient_scale_sigma) const {
    return covariance + gradient_scale_sigma * gradient_scale_sigma * by_scale * by_scale.transpose();
  }
};

/// What an edge says. Where it says nothing, overlapping frames are known to a radian and to the sensor's
/// width.
UncertainMotion uncertain_motion(const PoseGraphEdge& edge);

/// a_T_b and b_T_c to a_T_c, measured independently.
UncertainMotion compose(const UncertainMotion& a, const UncertainMotion& b);

}  // namespace gelslam
