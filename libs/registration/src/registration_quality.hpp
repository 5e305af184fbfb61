#pragma once

#include "gelslam/registration/normal_flow.hpp"
#include "normal_flow_reference.hpp"
#include "texture_agreement.hpp"

namespace gelslam::registration::detail {

/// The target for warp_residuals(); refers to the surface's maps.
TargetView view_of(const Surface& target);

/// The weighted normal equations of one warp.
struct NormalEquations {
  Eigen::Matrix<double, kParameters, kParameters> hessian;
  Eigen::Matrix<double, kParameters, 1> gradient;
};
NormalEquations linearise(const Samples& samples, const Residuals& residuals);

int count_shared(const Residuals& residuals);

/// Information that says "stay near the start" (rx ry rz tx ty), in the units of the information matrix. It
/// decides only along directions which the surface does not show.
Eigen::Matrix<double, kParameters, 1> prior_information(const NormalFlowOptions& options);

/// Variance of a normal residual for which n correlated samples count as n independent ones.
double effective_variance(double normal_rmse_rad, const NormalFlowOptions& options);

/// Heights of the target against those of the warped samples, over the shared contact.
struct HeightGap {
  double mean_mm = 0;  ///< what tz still lacks
  double rmse_mm = 0;  ///< about the mean
};
HeightGap height_gap(const Samples& samples, const Surface& target, const Pose& target_T_reference,
                     const Residuals& residuals);

/// Fills SCR, CCS, rms values, information, observability and status from the residuals at the final pose.
/// Returns the directions in which the two surfaces show more than noise; information is zero along the
/// others.
Directions assess(const NormalFlowReference::Impl& reference, const Surface& target,
                  const Residuals& residuals, const NormalFlowOptions& options, RegistrationResult& result);

}  // namespace gelslam::registration::detail
