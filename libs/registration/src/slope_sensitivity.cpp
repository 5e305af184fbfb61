#include "gelslam/registration/slope_sensitivity.hpp"

#include <Eigen/Cholesky>
#include <iterator>

#include "gelslam/core/index.hpp"
#include "normal_flow_kernels.hpp"
#include "normal_flow_reference.hpp"
#include "registration_quality.hpp"

namespace gelslam {
namespace {

using namespace registration::detail;

constexpr double kMinTurnCosine = 0.1;  // beyond, two frames share nothing
using NormalByFactor = Eigen::Matrix<double, 3, SlopeSensitivity::kTerms>;
using PoseByFactor = Eigen::Matrix<double, kParameters, SlopeSensitivity::kTerms>;

/// How a corrected normal at a pixel changes with the factors: dn = dn/dg dg, dg = -terms.
NormalByFactor normal_by_factor(const Eigen::Vector3d& n, const Surface& surface, const cv::Point& pixel) {
  const cv::Point2f place = SlopeCorrection::place(surface.normals.size(), pixel);
  const CameraModel camera = surface.camera();
  const Eigen::Vector2d rest = camera.rest_slope(camera.rest_point_mm(camera.to_mm(pixel)).head<2>());
  const auto gx = static_cast<float>(-n.x() / n.z() - rest.x()),
             gy = static_cast<float>(-n.y() / n.z() - rest.y());
  const SlopeCorrection::Terms terms = SlopeCorrection::terms(place.x, place.y, gx, gy);
  NormalByFactor result;
  for (int axis = 0; axis < 2; ++axis) {
    const auto& of_axis = terms[index(axis)];
    const Eigen::Map<const Eigen::RowVectorXf> row(of_axis.data(), std::ssize(of_axis));
    // n = (-gx, -gy, 1) / |.|, so dn/dg = -n_z (e - n n_axis); with dg = -term both signs cancel.
    const Eigen::Vector3d by_slope = n.z() * (Eigen::Vector3d::Unit(axis) - n * n[axis]);
    result.middleCols(axis * row.size(), row.size()) = by_slope * row.cast<double>();
  }
  return result;
}

/// Sums over the shared samples: of the pose's own normal equations, mixed with the factors', and of the
/// factors'.
struct Sums {
  Eigen::Matrix<double, kParameters, kParameters> pose =
      Eigen::Matrix<double, kParameters, kParameters>::Zero();
  PoseByFactor mixed = PoseByFactor::Zero();
  SlopeSensitivity::TermMatrix factors = SlopeSensitivity::TermMatrix::Zero();
  Eigen::Matrix<double, kParameters, 1> pose_pull = Eigen::Matrix<double, kParameters, 1>::Zero();
  SlopeSensitivity::PerTerm factor_pull = SlopeSensitivity::PerTerm::Zero();
};

}  // namespace

SlopeSensitivity slope_sensitivity(const NormalFlowReference& reference, const Surface& target,
                                   const Pose& target_T_reference, const NormalFlowOptions& options) {
  SlopeSensitivity result;
  const Samples& samples = reference.impl().samples;
  Residuals residuals;
  residuals.resize(static_cast<std::size_t>(samples.size()));
  const Eigen::Matrix<float, 3, 3, Eigen::RowMajor> rotation = target_T_reference.linear().cast<float>();
  const Eigen::Vector3f translation = target_T_reference.translation().cast<float>();
  warp_residuals(samples, view_of(target), rotation.data(), translation.data(), residuals);
  if (count_shared(residuals) < options.min_shared_pixels || target_T_reference(2, 2) < kMinTurnCosine)
    return result;
  apply_robust_weights(residuals, static_cast<float>(options.robust_scale_rad));

  const PixelLookup in_target(samples, target, target_T_reference);
  const PixelLookup in_reference(samples, reference.surface(), Pose::Identity());
  const Eigen::Matrix3d reference_R_target = target_T_reference.linear().transpose();
  Sums sums;
  const std::size_t step = thinning(residuals);
  for (std::size_t k = 0; k < residuals.weight.size(); k += step) {
    const double w = static_cast<double>(step) * residuals.weight[k];
    if (w <= 0) continue;
    const cv::Point at_target = in_target.pixel(in_target.warped_mm(k));
    const cv::Point at_reference = in_reference.pixel({samples.x[k], samples.y[k], samples.z[k]});
    // Taken at the mean of both normals. Taken at each normal, its noise, which is in the residual too, would
    // favor flatter slopes.
    const Eigen::Vector3d r(residuals.rx[k], residuals.ry[k], residuals.rz[k]);
    const Eigen::Vector3d n =
        (Eigen::Vector3d(samples.nx[k], samples.ny[k], samples.nz[k]) + 0.5 * r).normalized();
    const Eigen::Vector3d n_in_target = reference_R_target.transpose() * n;
    if (n.z() < kMinTurnCosine || n_in_target.z() < kMinTurnCosine) continue;
    const NormalByFactor by_factor = reference_R_target * normal_by_factor(n_in_target, target, at_target) -
                                     normal_by_factor(n, reference.surface(), at_reference);
    const Eigen::Matrix<double, 3, kParameters> jacobian = jacobian_of(samples, k).cast<double>();
    sums.pose += w * jacobian.transpose() * jacobian;
    sums.mixed += w * jacobian.transpose() * by_factor;
    sums.factors += w * by_factor.transpose() * by_factor;
    sums.pose_pull += w * jacobian.transpose() * r;
    sums.factor_pull -= w * by_factor.transpose() * r;
    result.weight += w;
  }
  // r + by_factor d - jacobian s is left, the pose moves by exp(-s): s = pose⁻¹ (pose_pull + mixed d).
  sums.pose.diagonal() += prior_information(options) * normal_variance(0.0, options);
  const auto factor = sums.pose.ldlt();
  const PoseByFactor step_by_factor = factor.solve(sums.mixed);
  // z does not depend on the factors: heights are integrated from the slopes, with the bare gel around as
  // zero, and turn with the patch.
  result.pose_by_factor.topRows<kParameters>() = -step_by_factor;
  result.hessian = sums.factors - sums.mixed.transpose() * step_by_factor;
  result.pull = sums.factor_pull + sums.mixed.transpose() * factor.solve(sums.pose_pull);
  return result;
}

}  // namespace gelslam
