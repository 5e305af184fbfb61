#include "gelslam/registration/normal_flow.hpp"

#include <Eigen/Cholesky>

#include "normal_flow_kernels.hpp"
#include "normal_flow_reference.hpp"
#include "registration_quality.hpp"

namespace gelslam {
namespace {

using namespace registration::detail;
using Vector5d = Eigen::Matrix<double, kParameters, 1>;
using Matrix5d = Eigen::Matrix<double, kParameters, kParameters>;

struct NormalEquations {
  Matrix5d hessian;
  Vector5d gradient;
};

NormalEquations linearise(const Samples& samples, const Residuals& residuals) {
  double entries[kHessianEntries];
  NormalEquations equations;
  accumulate_normal_equations(samples, residuals, equations.gradient.data(), entries);
  const double* entry = entries;
  for (int a = 0; a < kParameters; ++a)
    for (int b = a; b < kParameters; ++b) equations.hessian(a, b) = equations.hessian(b, a) = *entry++;
  return equations;
}

void warp(const Samples& samples, const PackedTarget& target, const Pose& target_T_reference, Residuals& residuals) {
  const Eigen::Matrix<float, 3, 3, Eigen::RowMajor> rotation = target_T_reference.linear().cast<float>();
  const Eigen::Vector3f translation = target_T_reference.translation().cast<float>();
  warp_residuals(samples, target, rotation.data(), translation.data(), residuals);
}

Vector6d with_zero_tz(const Vector5d& step) {
  Vector6d xi;
  xi << step, 0.0;
  return xi;
}

}  // namespace

RegistrationResult register_normal_flow(const NormalFlowReference& reference, const Surface& target, const Pose& initial,
                                        const NormalFlowOptions& options) {
  RegistrationResult result;
  result.target_T_reference = initial;
  const Samples& samples = reference.impl().samples;
  if (samples.size() < options.min_shared_pixels || target.contact_pixels < options.min_shared_pixels) return result;

  thread_local PackedTarget packed;
  thread_local Residuals residuals;
  pack_target(target, packed);
  residuals.resize(static_cast<std::size_t>(samples.size()));
  const Vector5d prior = prior_information(options) * effective_variance(0.0, options);

  bool settled = false;
  Pose& target_T_reference = result.target_T_reference;
  while (result.iterations < options.max_iterations && !settled) {
    warp(samples, packed, target_T_reference, residuals);
    if (count_shared(residuals) < options.min_shared_pixels) {
      result.status = RegistrationStatus::too_little_overlap;
      return result;
    }
    apply_robust_weights(residuals, static_cast<float>(options.robust_scale_rad));
    NormalEquations equations = linearise(samples, residuals);
    const Vector5d from_initial = se3_log(initial.inverse() * target_T_reference).head<kParameters>();
    equations.hessian.diagonal() += prior;
    equations.gradient += prior.cwiseProduct(from_initial);
    const Vector5d step = equations.hessian.ldlt().solve(equations.gradient);
    target_T_reference = target_T_reference * se3_exp(with_zero_tz(step)).inverse();
    ++result.iterations;
    settled = result.iterations >= options.min_iterations && step.head<3>().norm() < options.rotation_tolerance_rad &&
              step.tail<2>().norm() < options.translation_tolerance_mm;
  }
  target_T_reference = normalized(target_T_reference);

  warp(samples, packed, target_T_reference, residuals);
  apply_robust_weights(residuals, static_cast<float>(options.robust_scale_rad));
  const HeightGap gap = height_gap(samples, target, target_T_reference, residuals);
  target_T_reference.translation().z() += gap.mean_mm;
  result.height_rmse_mm = gap.rmse_mm;
  assess(reference.impl(), target, residuals, options, result);
  return result;
}

}  // namespace gelslam
