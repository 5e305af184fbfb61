// Errors of a trajectory: mean absolute errors along the six axes (as in Huang et al., NormalFlow, RA-L
// 2024), and absolute and relative pose errors (Sturm et al. 2012). Both trajectories are expressed relative
// to a common reference frame.

#include "gelslam/evaluation/trajectory_metrics.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

/// True and estimated pose of a frame, relative to the reference frame.
struct PosePair {
  int index;
  Pose estimated;
  Pose truth;
};

std::vector<PosePair> pairs_relative_to(const std::vector<IndexedPose>& estimate,
                                        const std::vector<std::optional<Pose>>& start_T_currs,
                                        int reference_index) {
  const auto reference = std::ranges::find(estimate, reference_index, &IndexedPose::index);
  const auto& true_reference = start_T_currs.at(static_cast<std::size_t>(reference_index));
  if (reference == estimate.end() || !true_reference)
    throw Error("the reference frame must have an estimated and a true pose");
  const Pose reference_T_map = reference->map_T_sensor.inverse();
  const Pose reference_T_start = true_reference->inverse();
  std::vector<PosePair> pairs;
  for (const IndexedPose& pose : estimate) {
    const auto& truth = start_T_currs.at(static_cast<std::size_t>(pose.index));
    if (truth) pairs.push_back({pose.index, reference_T_map * pose.map_T_sensor, reference_T_start * *truth});
  }
  return pairs;
}

void set_axis_errors(const std::vector<PosePair>& pairs, TrajectoryMetrics& metrics) {
  Vector6d sum = Vector6d::Zero();
  for (const PosePair& pair : pairs) sum += axis_error(pair.estimated, pair.truth).cwiseAbs();
  sum /= static_cast<double>(pairs.size());
  metrics.mae_mm = sum.head<3>();
  metrics.mae_deg = sum.tail<3>();
  metrics.geometric_mean_mm = geometric_mean_mm(sum);
}

/// Returns the RMSE of the translation after the best rigid alignment of the estimate with the truth (Kabsch,
/// without scale).
double aligned_rmse_mm(const std::vector<PosePair>& pairs) {
  Eigen::Matrix3Xd estimated(3, pairs.size()), truth(3, pairs.size());
  for (Eigen::Index i = 0; i < truth.cols(); ++i) {
    estimated.col(i) = pairs[static_cast<std::size_t>(i)].estimated.translation();
    truth.col(i) = pairs[static_cast<std::size_t>(i)].truth.translation();
  }
  const Eigen::Affine3d truth_T_estimated(Eigen::umeyama(estimated, truth, false));
  return std::sqrt((truth_T_estimated * estimated - truth).colwise().squaredNorm().mean());
}

RelativePoseError relative_error(const std::vector<PosePair>& pairs, int frames_apart) {
  RelativePoseError error;
  double translation_sum = 0.0, rotation_sum = 0.0;
  std::size_t later = 0;
  for (const PosePair& from : pairs) {
    while (later < pairs.size() && pairs[later].index < from.index + frames_apart) ++later;
    if (later == pairs.size()) break;
    const PosePair& to = pairs[later];
    if (to.index != from.index + frames_apart) continue;
    const Pose true_motion = from.truth.inverse() * to.truth;
    const Pose difference = true_motion.inverse() * (from.estimated.inverse() * to.estimated);
    translation_sum += difference.translation().squaredNorm();
    rotation_sum += std::pow(rotation_angle_rad(difference) * kDegreesPerRadian, 2);
    ++error.pairs;
  }
  if (error.pairs > 0) {
    error.translation_mm = std::sqrt(translation_sum / error.pairs);
    error.rotation_deg = std::sqrt(rotation_sum / error.pairs);
  }
  return error;
}

}  // namespace

Eigen::Vector3d euler_zxy_deg(const Eigen::Matrix3d& r) {
  // For Ry Rx Rz, the middle row is (cos rx sin rz, cos rx cos rz, -sin rx), and the last column is (sin ry
  // cos rx, -sin rx, cos ry cos rx).
  const double cos_rx = std::hypot(r(0, 2), r(2, 2));
  const double rx = std::atan2(-r(1, 2), cos_rx);
  if (cos_rx < 1e-7) return kDegreesPerRadian * Eigen::Vector3d(rx, 0.0, std::atan2(-r(0, 1), r(0, 0)));
  return kDegreesPerRadian * Eigen::Vector3d(rx, std::atan2(r(0, 2), r(2, 2)), std::atan2(r(1, 0), r(1, 1)));
}

Vector6d axis_error(const Pose& estimated, const Pose& truth) {
  const Eigen::Vector3d turn_deg = euler_zxy_deg(estimated.linear()) - euler_zxy_deg(truth.linear());
  Vector6d error;
  error << estimated.translation() - truth.translation(),
      turn_deg.unaryExpr([](double angle) { return std::remainder(angle, 360.0); });
  return error;
}

double geometric_mean_mm(const Vector6d& errors) {
  const Eigen::Vector3d mm = errors.head<3>(), rotations_as_mm = kMillimetersPerDegree * errors.tail<3>();
  return std::pow(mm.prod() * rotations_as_mm.prod(), 1.0 / 6.0);
}

int choose_reference_index(const std::vector<IndexedPose>& estimate,
                           const std::vector<std::optional<Pose>>& start_T_currs,
                           std::optional<int> preferred) {
  std::optional<int> first;
  for (const IndexedPose& pose : estimate) {
    if (!start_T_currs.at(static_cast<std::size_t>(pose.index))) continue;
    if (pose.index == preferred) return pose.index;
    if (!first) first = pose.index;
  }
  if (!first)
    throw Error("no frame has both an estimated and a true pose: do run and truth belong together?");
  return *first;
}

TrajectoryMetrics evaluate_trajectory(const std::vector<IndexedPose>& estimate,
                                      const std::vector<std::optional<Pose>>& start_T_currs,
                                      int reference_index, double fps) {
  const std::vector<PosePair> pairs = pairs_relative_to(estimate, start_T_currs, reference_index);
  if (pairs.size() < 2)
    throw Error(
        "only one frame has both an estimated and a true pose, to which errors would be relative: there is "
        "nothing to measure");
  TrajectoryMetrics metrics;
  for (const auto& truth : start_T_currs) metrics.touched_frames += truth.has_value() ? 1 : 0;
  metrics.compared_frames = static_cast<int>(pairs.size());
  metrics.estimated_without_touch = static_cast<int>(estimate.size() - pairs.size());
  set_axis_errors(pairs, metrics);
  double squared_mm2 = 0.0, squared_deg2 = 0.0;
  for (const PosePair& pair : pairs) {
    squared_mm2 += (pair.estimated.translation() - pair.truth.translation()).squaredNorm();
    squared_deg2 +=
        std::pow(rotation_angle_rad(pair.truth.inverse() * pair.estimated) * kDegreesPerRadian, 2);
  }
  metrics.ate_mm = std::sqrt(squared_mm2 / static_cast<double>(pairs.size()));
  metrics.rotation_rmse_deg = std::sqrt(squared_deg2 / static_cast<double>(pairs.size()));
  metrics.ate_aligned_mm = aligned_rmse_mm(pairs);
  metrics.over_one_frame = relative_error(pairs, 1);
  metrics.over_one_second = relative_error(pairs, std::max(1, static_cast<int>(std::lround(fps))));
  const PosePair& last = pairs.back();
  metrics.final_mm = (last.estimated.translation() - last.truth.translation()).norm();
  metrics.final_deg = rotation_angle_rad(last.truth.inverse() * last.estimated) * kDegreesPerRadian;
  return metrics;
}

}  // namespace gelslam
