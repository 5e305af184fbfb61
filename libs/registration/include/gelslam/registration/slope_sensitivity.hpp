#pragma once

#include <Eigen/Core>

#include "gelslam/registration/normal_flow.hpp"
#include "gelslam/surface/slope_correction.hpp"

namespace gelslam {

/// How a registration depends on a SlopeCorrection of both surfaces, to first order about the one applied,
/// and what the residuals of the normals state about it: two frames that see one place in different parts of
/// the gel, at different tilts, must read the same normals there once they are aligned.
struct SlopeSensitivity {
  static constexpr int kTerms = static_cast<int>(SlopeCorrection::kTerms);
  using PerTerm = Eigen::Matrix<double, kTerms, 1>;
  using TermMatrix = Eigen::Matrix<double, kTerms, kTerms>;

  /// With factors larger by d, the registration would find target_T_reference * exp(pose_by_factor * d). The
  /// row of z is zero: heights turn with the slopes that they come from.
  Eigen::Matrix<double, 6, kTerms> pose_by_factor = Eigen::Matrix<double, 6, kTerms>::Zero();
  /// Residual left for the best pose, sum of w |r|² / 2 over normals: -pull' d + d' hessian d / 2. Not
  /// divided by any variance; `weight` is the sum of w.
  TermMatrix hessian = TermMatrix::Zero();
  PerTerm pull = PerTerm::Zero();
  double weight = 0;
};

/// The sensitivity for two corrected surfaces at the pose that registration found. All zero where hardly
/// anything is shared. Source: own.
SlopeSensitivity slope_sensitivity(const NormalFlowReference& reference, const Surface& target,
                                   const Pose& target_T_reference, const NormalFlowOptions& options);

}  // namespace gelslam
