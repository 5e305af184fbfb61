// NormalFlow: the pose target_T_reference = (R, t) between two surfaces, by their normals and heights.
//
// It minimizes the sum over samples of the reference's contact of w |Rᵀ n'(π(R q + t)) - n|², where q is a
// sample's point, n its normal, n' the target's normal at the pixel π(...), and w the confidence of both
// normals times a Cauchy weight. Gauss-Newton steps over rx ry rz tx ty are inverse compositional (Baker &
// Matthews, IJCV 2004; Huang, Kaess, Yuan, NormalFlow, RA-L 2024); tz is the mean height difference over the
// shared contact. The prior's information is added to the normal equations, so the result is the maximum of
// prior times likelihood; the papers have no prior.
//
// The first pass uses the gradients of the normals as they are, including their noise. If noise is more than
// a tenth of the signal along some direction of motion, a second pass projects the normal equations onto the
// signal that both surfaces share (ObservableDirections). This second pass is not in the papers.
//
// It fails if the motion exceeds half a period of the texture, because it then converges to the neighboring
// period. It is biased toward no motion if a pattern of the gel, which moves with the gel, looks like
// texture. assess() and verify_registered() detect such results.

#include "gelslam/registration/normal_flow.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "normal_flow_kernels.hpp"
#include "normal_flow_reference.hpp"
#include "registration_quality.hpp"

namespace gelslam {
namespace {

using namespace registration::detail;

void warp(const Samples& samples, const TargetView& target, const Pose& target_T_reference,
          Residuals& residuals) {
  const Eigen::Matrix<float, 3, 3, Eigen::RowMajor> rotation = target_T_reference.linear().cast<float>();
  const Eigen::Vector3f translation = target_T_reference.translation().cast<float>();
  warp_residuals(samples, target, rotation.data(), translation.data(), residuals);
}

Vector6d with_tz(const Vector5d& step, const Viewpoint& view) {
  Vector6d xi;
  xi << step, view.tz_of_turn(step[0], step[1]);
  return xi;
}

/// Returns the information of the prior for a pass with observable directions. The covariance of the prior is
/// expressed in the basis of these directions, and correlations between them are neglected, so that a
/// direction which the surfaces do not show stays at the prior.
Matrix5d information_of(const PosePrior& prior, const ObservableDirections& along) {
  const Matrix5d step = prior.step_covariance.topLeftCorner<kParameters, kParameters>();
  const Vector5d variance = (along.dual_basis.transpose() * step * along.dual_basis).diagonal();
  return along.dual_basis * variance.cwiseInverse().asDiagonal() * along.dual_basis.transpose();
}

/// Projects the normal equations onto the signal that both surfaces share, so that there is no step along a
/// direction in which the gradients are noise.
void project_observable(const ObservableDirections& directions, NormalEquations& equations) {
  equations.gradient = (directions.dual_basis * directions.signal_fraction.asDiagonal() *
                        directions.basis.transpose() * equations.gradient)
                           .eval();
  equations.hessian =
      directions.dual_basis * directions.signal_fraction.asDiagonal() * directions.dual_basis.transpose();
}

// The second pass is omitted if both surfaces share at least this fraction of the signal along each
// direction.
constexpr double kHardlyNoise = 0.9;
// The iterations end after kPatience successive steps that do not reduce the sum of squared residuals by more
// than the variance of one sample. On a surface with little texture, further steps would be random. If the
// residuals are far above the noise of normals, there may be progress that the sum does not show, and
// kPatienceInNoise such steps are allowed.
constexpr int kPatience = 3, kPatienceInNoise = 20;

/// Detects that the residuals no longer become smaller.
class Progress {
 public:
  explicit Progress(const NormalFlowOptions& options)
      : options_(options), noise_variance_(normal_variance(0.0, options)) {}

  void add(const ResidualSums& sums) {
    const double mean_square = sums.squares / std::max(sums.weight, std::numeric_limits<float>::min());
    const bool smaller = (least_ - mean_square) * sums.weight > noise_variance_;
    stale_ = smaller ? 0 : stale_ + 1;
    patience_ = is_far_above_noise(std::sqrt(mean_square), options_) ? kPatienceInNoise : kPatience;
    least_ = std::min(least_, mean_square);
  }
  bool over() const { return stale_ >= patience_; }

 private:
  const NormalFlowOptions& options_;
  double noise_variance_;
  double least_ = std::numeric_limits<double>::max();
  int stale_ = 0, patience_ = kPatience;
};

/// The registration of one target to a reference.
class Alignment {
 public:
  Alignment(const NormalFlowReference::Impl& reference, const Surface& target,
            const NormalFlowOptions& options)
      : reference_(reference), target_(target), view_(view_of(target)), options_(options) {
    residuals().resize(static_cast<std::size_t>(reference.samples.size()));
  }

  /// Iterates Gauss-Newton steps to the maximum of prior times likelihood, beginning at the pose in `result`.
  /// Returns false if the surfaces no longer overlap at some step. If `directions` is not null, the normal
  /// equations are projected onto them. `noise_variance` is the variance of one residual.
  bool converge(const PosePrior& prior, const ObservableDirections* directions, double noise_variance,
                RegistrationResult& result) {
    Progress progress(options_);
    const Matrix5d of_prior =
        noise_variance *
        (directions ? information_of(prior, *directions)
                    : Matrix5d(prior.step_covariance.topLeftCorner<kParameters, kParameters>().inverse()));
    Pose& target_T_reference = result.target_T_reference;
    bool converged = false;
    for (int done = 0; done < options_.max_iterations && !converged; ++done, ++result.iterations) {
      evaluate_residuals(target_T_reference);
      if (count_shared(residuals()) < options_.min_shared_samples) return false;
      // Along oblique rays pixels move with z, so z is set before the first step.
      if (done == 0)
        target_T_reference.translation().z() +=
            height_gap(reference_.samples, target_, target_T_reference, residuals()).mean_mm;
      progress.add(sum_residuals(residuals()));
      const Viewpoint view = viewpoint_of(view_, target_T_reference, reference_.samples, residuals());
      NormalEquations equations = linearize(reference_.samples, view, residuals());
      if (directions) project_observable(*directions, equations);
      equations.hessian += of_prior;
      equations.gradient += of_prior * se3_log(prior.pose.inverse() * target_T_reference).head<kParameters>();
      const Vector5d step = equations.hessian.ldlt().solve(equations.gradient);
      target_T_reference = target_T_reference * se3_exp(with_tz(step, view)).inverse();
      // A step is noise if its Mahalanobis norm, in the covariance of the estimate, is below 1.
      const bool is_noise = step.dot(equations.hessian * step) < noise_variance;
      step_not_converged_ = !is_noise && is_large(step);
      converged =
          done + 1 >= options_.min_iterations && (is_noise || (progress.over() && !step_not_converged_));
    }
    target_T_reference = normalized(target_T_reference);
    return true;
  }

  /// Registers the target, beginning at the prior's `start`.
  RegistrationResult align(const PosePrior& prior) {
    RegistrationResult result;
    result.target_T_reference = prior.start;
    result.status = RegistrationStatus::too_little_overlap;
    const double noise_variance = variance_in_sums(0.0, reference_, options_);
    if (!converge(prior, nullptr, noise_variance, result)) return result;
    const ObservableDirections directions = finish(prior, result);
    if (directions.signal_fraction.minCoeff() > kHardlyNoise) return result;
    // In the first pass, noise has moved the pose along directions that the surfaces hardly show. The second
    // pass moves it back to the prior there.
    RegistrationResult second = result;
    if (!converge(prior, &directions, noise_variance, second)) return result;
    finish(prior, second);
    return second;
  }

  /// Evaluates the pose in `result` without changing it.
  void judge(const PosePrior& prior, RegistrationResult& result) {
    const HeightGap gap = evaluate_residuals_and_heights(result.target_T_reference);
    result.height_rmse_mm = std::hypot(gap.rmse_mm, gap.mean_mm);
    assess(reference_, target_, residuals(), prior, options_, result);
  }

  /// Corrects z by the heights and evaluates the result. Returns the directions of motion and how far the
  /// surfaces show them.
  ObservableDirections finish(const PosePrior& prior, RegistrationResult& result) {
    const HeightGap gap = evaluate_residuals_and_heights(result.target_T_reference);
    result.target_T_reference.translation().z() += gap.mean_mm;
    result.height_rmse_mm = gap.rmse_mm;
    ObservableDirections directions = assess(reference_, target_, residuals(), prior, options_, result);
    if (result.ok() && step_not_converged_) result.status = RegistrationStatus::diverged;
    return directions;
  }

 private:
  /// Computes the residuals of a pose with their robust weights.
  void evaluate_residuals(const Pose& target_T_reference) {
    warp(reference_.samples, view_, target_T_reference, residuals());
    apply_robust_weights(residuals(), static_cast<float>(options_.robust_scale_rad));
  }

  /// Computes the residuals of a pose, and the difference between the heights.
  HeightGap evaluate_residuals_and_heights(const Pose& target_T_reference) {
    evaluate_residuals(target_T_reference);
    return height_gap(reference_.samples, target_, target_T_reference, residuals());
  }

  /// Returns whether a step is larger than a tenth of kObservableSigmaMm.
  bool is_large(const Vector5d& step) const {
    return 10 * std::max(kMmPerRad * step.head<3>().norm(), step.tail<2>().norm()) > kObservableSigmaMm;
  }

  // Returns the work buffer, which is kept between registrations.
  static Residuals& residuals() {
    thread_local Residuals buffer;
    return buffer;
  }

  const NormalFlowReference::Impl& reference_;
  const Surface& target_;
  TargetView view_;
  const NormalFlowOptions& options_;
  bool step_not_converged_ = false;  // the last step was still large when the iterations ran out
};

/// Returns the options with all values in rad and mm multiplied by the noise of the surfaces
/// (shared_noise()).
NormalFlowOptions scaled(NormalFlowOptions options, double noise) {
  options.robust_scale_rad *= noise;
  options.normal_noise_rad *= noise;
  options.height_noise_mm *= noise;
  return options;
}

bool has_enough_surface(const NormalFlowReference& reference, const Surface& target,
                        const NormalFlowOptions& options) {
  return reference.sample_count() >= options.min_shared_samples &&
         target.contact_pixels >= options.min_shared_samples;
}

}  // namespace

double shared_noise(const Surface& a, const Surface& b) {
  return std::max(a.slope_noise_ratio, b.slope_noise_ratio);
}

RegistrationResult judge_pose(const NormalFlowReference& reference, const Surface& target,
                              const Pose& target_T_reference, const NormalFlowOptions& unscaled) {
  const NormalFlowOptions options = scaled(unscaled, shared_noise(reference.surface(), target));
  RegistrationResult result;
  result.target_T_reference = target_T_reference;
  if (has_enough_surface(reference, target, options))
    Alignment(reference.impl(), target, options).judge(target_T_reference, result);
  return result;
}

RegistrationResult register_normal_flow(const NormalFlowReference& reference, const Surface& target,
                                        const PosePrior& prior, const NormalFlowOptions& unscaled) {
  const NormalFlowOptions options = scaled(unscaled, shared_noise(reference.surface(), target));
  RegistrationResult result;
  result.target_T_reference = prior.start;
  if (!has_enough_surface(reference, target, options)) return result;
  return Alignment(reference.impl(), target, options).align(prior);
}

}  // namespace gelslam
