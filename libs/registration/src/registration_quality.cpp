// Evaluates a registration at its final pose: the acceptance tests of NormalFlow (shared curvature ratio SCR
// and curvature cosine similarity CCS; Huang et al., RA-L 2024), and, not in the papers, the texture
// correlation, the directions of motion that both surfaces show, the information matrix and the observability
// of the pose (docs/algorithms.md, NormalFlow).

#include "registration_quality.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "gelslam/surface/slopes.hpp"

namespace gelslam::registration::detail {
namespace {

// The change of the normals per mm that a gel pattern may cause: an error of the model or an unevenness that
// stays with the gel and looks like texture.
constexpr double kGelPatternRadPerMm = 0.12;

struct CurvatureAgreement {
  double shared_ratio = 0;         // SCR
  double cosine_similarity = 0;    // CCS
  double texture_correlation = 0;  // the correlation coefficient of the curvatures
  double rms_per_mm = 0;           // the root mean square of the reference's curvature in 1/mm
};

CurvatureAgreement compare_curvature(const NormalFlowReference::Impl& reference, const Surface& target,
                                     const Residuals& residuals, const Pose& target_T_reference) {
  const PixelLookup lookup(reference.samples, target, target_T_reference);
  double all = 0, shared = 0, sum = 0, target_sum = 0, dot = 0, reference2 = 0, target2 = 0;
  int count = 0;
  for (std::size_t k = 0; k < reference.curvature.size(); ++k) {
    const double c = reference.curvature[k];
    all += std::fabs(c);
    if (residuals.weight[k] <= 0) continue;
    const cv::Point at = lookup.pixel(lookup.warped_mm(k));
    const double d = target.curvature(at);
    shared += std::fabs(c);
    if (!is_read(target, at)) continue;
    ++count;
    dot += c * d;
    reference2 += c * c;
    target2 += d * d;
    sum += c;
    target_sum += d;
  }
  CurvatureAgreement agreement;
  if (all > 0) agreement.shared_ratio = shared / all;
  if (reference2 > 0 && target2 > 0) agreement.cosine_similarity = dot / std::sqrt(reference2 * target2);
  if (count == 0) return agreement;
  agreement.rms_per_mm = std::sqrt(reference2 / count) / reference.surface->pixel_pitch_mm;
  const double spread2 = (reference2 - sum * sum / count) * (target2 - target_sum * target_sum / count);
  if (spread2 > 0) agreement.texture_correlation = (dot - sum * target_sum / count) / std::sqrt(spread2);
  return agreement;
}

double normal_rmse_rad(const Residuals& residuals) {
  double sum = 0, weight = 0;
  for (std::size_t k = 0; k < residuals.weight.size(); ++k) {
    const double w = residuals.weight[k], rx = residuals.rx[k], ry = residuals.ry[k], rz = residuals.rz[k];
    sum += w * (rx * rx + ry * ry + rz * rz);
    weight += w;
  }
  return weight > 0 ? std::sqrt(sum / weight) : 0.0;
}

/// Returns RegistrationResult::observable. The covariance of the motions of the shared center follows from
/// the information of the registration and that of an unknown pose. It is transformed from the axes of the
/// reference to those of the target, which are the axes of the sensor at the time of the target.
std::array<bool, 6> observability(const RegistrationResult& result, bool heights_known) {
  const Eigen::Matrix3d target_R_reference = result.target_T_reference.linear();
  const Matrix6d from_center = origin_from_center(result.shared_center_mm);
  Matrix6d with_prior = from_center.transpose() * result.information * from_center;
  with_prior += inverted(unknown_pose_covariance());
  const Matrix6d covariance = inverted(with_prior);
  const auto known = [&](int axis, int first, double limit) {
    const Eigen::Vector3d direction = target_R_reference.row(axis);
    return direction.dot(covariance.block<3, 3>(first, first) * direction) < limit * limit;
  };
  std::array<bool, 6> observable{};
  for (int axis = 0; axis < 3; ++axis) {
    observable[static_cast<std::size_t>(axis)] = known(axis, 3, kObservableSigmaMm);
    observable[static_cast<std::size_t>(3 + axis)] = known(axis, 0, kObservableSigmaMm / kMmPerRad);
  }
  observable[2] = heights_known;  // z follows from the heights, not from the texture
  return observable;
}

/// Returns the standard deviation of the correlation between two independent noises, 1 / sqrt(2 m), where m
/// is the number of patches of the shared contact whose noise is independent.
double share_by_chance(double shared_share, const NormalFlowReference::Impl& reference) {
  const double patches = shared_share * reference.surface->contact_mm2() / kNoisePatchMm2;
  return 1.0 / std::sqrt(2.0 * std::max(1.0, patches));
}

/// Returns whether the surfaces agree by CCS. If normals change by less than their noise from one pixel of a
/// GelSight Mini to the next, CCS would compare noise; then it suffices that the residuals of the normals are
/// small.
bool curvature_matches(const CurvatureAgreement& agreement, double normal_rmse_rad,
                       const NormalFlowOptions& options) {
  if (agreement.cosine_similarity >= options.curvature.min_ccs) return true;
  constexpr double kPixelMm = 0.0634;
  return agreement.rms_per_mm * kPixelMm < options.normal_noise_rad &&
         !is_far_above_noise(normal_rmse_rad, options);
}

RegistrationStatus judge(const RegistrationResult& result, const CurvatureAgreement& agreement,
                         const NormalFlowOptions& options) {
  if (result.shared_samples < options.min_shared_samples || result.scr < options.curvature.min_scr)
    return RegistrationStatus::too_little_overlap;
  if (!curvature_matches(agreement, result.normal_rmse_rad, options))
    return RegistrationStatus::curvature_mismatch;
  return RegistrationStatus::converged;
}

}  // namespace

TargetView view_of(const Surface& target) {
  TargetView view;
  view.width = target.contact.cols;
  view.height = target.contact.rows;
  const CameraModel camera = target.camera();
  view.inverse_pitch_per_mm = static_cast<float>(1.0 / camera.pitch_mm);
  view.inverse_distance = static_cast<float>(camera.optics.inverse_distance());
  view.center_u_px = static_cast<float>(camera.center_px().x());
  view.center_v_px = static_cast<float>(camera.center_px().y());
  view.normals = target.normals.ptr<float>();
  view.confidence = (target.confidence.empty() ? target.contact : target.confidence).ptr();
  return view;
}

Viewpoint viewpoint_of(const TargetView& target, const Pose& target_T_reference, const Samples& samples,
                       const Residuals& residuals) {
  const Eigen::Vector3d ray =
      target_T_reference.translation() * target.inverse_distance + Eigen::Vector3d::UnitZ();
  const Eigen::Vector3f axis = (target_T_reference.linear().transpose() * ray).cast<float>();
  const auto [x, y, z] = shared_center_mm(samples, residuals);
  return {target.inverse_distance, {axis.x(), axis.y(), axis.z()}, x, y};
}

NormalEquations linearize(const Samples& samples, const Viewpoint& view, const Residuals& residuals) {
  double entries[kHessianEntries];
  NormalEquations equations;
  accumulate_normal_equations(samples, view, residuals, equations.gradient.data(), entries);
  const double* entry = entries;
  for (int a = 0; a < kParameters; ++a)
    for (int b = a; b < kParameters; ++b) equations.hessian(a, b) = equations.hessian(b, a) = *entry++;
  return equations;
}

int count_shared(const Residuals& residuals) {
  return static_cast<int>(
      std::count_if(residuals.weight.begin(), residuals.weight.end(), [](float w) { return w > 0; }));
}

double normal_variance(double normal_rmse_rad, const NormalFlowOptions& options) {
  const double noise = std::max(options.normal_noise_rad, normal_rmse_rad);
  return noise * noise;
}

double variance_in_sums(double normal_rmse_rad, const NormalFlowReference::Impl& reference,
                        const NormalFlowOptions& options) {
  const double samples_per_patch =
      kNoisePatchMm2 * reference.samples.size() / std::max(kNoisePatchMm2, reference.surface->contact_mm2());
  return 0.5 * normal_variance(normal_rmse_rad, options) * std::max(1.0, samples_per_patch);
}

HeightGap height_gap(const Samples& samples, const Surface& target, const Pose& target_T_reference,
                     const Residuals& residuals) {
  const PixelLookup lookup(samples, target, target_T_reference);
  double sum = 0, sum2 = 0, weight = 0;
  for (std::size_t k = 0; k < residuals.weight.size(); ++k) {
    const double w = residuals.weight[k];
    if (w <= 0) continue;
    const Eigen::Vector3f p = lookup.warped_mm(k);
    const double gap = target.height_mm(lookup.pixel(p)) - p.z();
    sum += w * gap;
    sum2 += w * gap * gap;
    weight += w;
  }
  if (weight <= 0) return {};
  const double mean = sum / weight;
  return {mean, std::sqrt(std::max(0.0, sum2 / weight - mean * mean))};
}

ObservableDirections observable_directions(const TextureAgreement& texture, double by_chance) {
  // The basis consists of the generalized eigenvectors b of common b = γ (read + pattern) b. The eigenvalue γ
  // is the fraction of the signal along b that both surfaces share.
  const Matrix5d scale = texture.read + texture.pattern + 1e-12 * Matrix5d::Identity();
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix5d> eigen(texture.common, scale);
  ObservableDirections result;
  result.basis = eigen.eigenvectors();
  result.dual_basis = scale * result.basis;  // the inverse of the basis, transposed
  result.signal_fraction = (eigen.eigenvalues().array() - by_chance).max(0.0).min(1.0);
  for (int i = 0; i < kParameters; ++i) {
    const double pattern = result.basis.col(i).dot(texture.pattern * result.basis.col(i));
    result.pattern_fraction[i] = std::min(1.0, pattern / std::max(pattern, eigen.eigenvalues()[i]));
  }
  return result;
}

ObservableDirections assess(const NormalFlowReference::Impl& reference, const Surface& target,
                            const Residuals& residuals, const PosePrior& prior,
                            const NormalFlowOptions& options, RegistrationResult& result) {
  result.shared_samples = count_shared(residuals);
  const auto [x, y, z] = shared_center_mm(reference.samples, residuals);
  result.shared_center_mm = {x, y, z};
  result.normal_rmse_rad = normal_rmse_rad(residuals);
  const CurvatureAgreement agreement =
      compare_curvature(reference, target, residuals, result.target_T_reference);
  result.scr = agreement.shared_ratio;
  result.ccs = agreement.cosine_similarity;
  result.texture_correlation = agreement.texture_correlation;

  const double shared_share = static_cast<double>(result.shared_samples) / reference.samples.size();
  const double noise = shared_noise(*reference.surface, target);
  const TextureAgreement texture = compare_texture(reference.samples, target, result.target_T_reference,
                                                   residuals, noise * kGelPatternRadPerMm);
  const ObservableDirections directions =
      observable_directions(texture, share_by_chance(shared_share, reference));
  const bool heights_known = reference.surface->zero_is_bare_gel && target.zero_is_bare_gel;
  const double slope_sigma_ratio = std::max(reference.surface->slope_sigma_ratio, target.slope_sigma_ratio);
  const double shared_mm2 = shared_share * reference.surface->contact_mm2();
  result.information =
      pose_information(directions, shared_mm2, slope_sigma_ratio,
                       variance_in_sums(result.normal_rmse_rad, reference, options), prior, result, options);
  // The five directions rotate about the shared center, because the heights determine z there.
  result.directions.setIdentity();
  result.directions.topLeftCorner<kParameters, kParameters>() = directions.basis;
  result.directions.block<1, kParameters>(5, 0) = x * directions.basis.row(1) - y * directions.basis.row(0);
  result.observable = observability(result, heights_known);
  result.status = judge(result, agreement, options);
  return directions;
}

}  // namespace gelslam::registration::detail
