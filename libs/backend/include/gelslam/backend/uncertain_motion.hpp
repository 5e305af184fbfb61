#pragma once

#include "gelslam/backend/pose_graph.hpp"

namespace gelslam {

/// A measured motion, with what is not known of it: noise, and what a gradient scale common to all
/// measurements does.
struct UncertainMotion {
  Pose from_T_to = Pose::Identity();
  Matrix6d covariance = Matrix6d::Zero();  ///< of the right perturbation (rad, mm)
  /// How the measurement changes with the gains along x and y, as a right perturbation: the same for all
  /// measurements.
  Eigen::Matrix<double, 6, 2> by_gain = Eigen::Matrix<double, 6, 2>::Zero();

  /// Noise and gains together, these known to `gradient_scale_sigma`.
  Matrix6d covariance_with_gain(double gradient_scale_sigma) const {
    return covariance + gradient_scale_sigma * gradient_scale_sigma * by_gain * by_gain.transpose();
  }
};

/// What an edge says. Where it says nothing, overlapping frames are known to a radian and to the sensor's
/// width.
UncertainMotion uncertain_motion(const PoseGraphEdge& edge);

/// a_T_b and b_T_c to a_T_c, measured independently.
UncertainMotion compose(const UncertainMotion& a, const UncertainMotion& b);

}  // namespace gelslam
