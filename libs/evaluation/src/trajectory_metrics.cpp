#include "gelslam/evaluation/trajectory_metrics.hpp"

#include <cmath>

#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

/// Both poses of a frame, relative to the reference frame.
struct PosePair {
  int index;
  Pose estimated;
  Pose truth;
};

double wrapped_deg(double angle_deg) { return std::remainder(angle_deg, 360.0); }

const IndexedPose* find(const std::vector<IndexedPose>& estimate, int index) {
  for (const IndexedPose& pose : estimate)
    if (pose.index == index) return &pose;
  return nullptr;
}

std::vector<PosePair> pairs_relative_to(const std::vector<IndexedPose>& estimate,
                                        const std::vector<std::optional<Pose>>& start_T_currs,
                                        int reference_index) {
  const IndexedPose* reference = find(estimate, reference_index);
  const auto& true_reference = start_T_currs.at(static_cast<std::size_t>(reference_index));
  if (!reference || !true_reference)
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
  for (const PosePair& pair : pairs) {
    metrics.mae_mm += (pair.estimated.translation() - pair.truth.translation()).cwiseAbs();
    const Eigen::Vector3d difference_deg =
        euler_zxy_deg(pair.estimated.linear()) - euler_zxy_deg(pair.truth.linear());
    metrics.mae_deg += difference_deg.unaryExpr(&wrapped_deg).cwiseAbs();
  }
  metrics.mae_mm /= static_cast<double>(pairs.size());
  metrics.mae_deg /= static_cast<double>(pairs.size());
  const Eigen::Vector3d rotations_as_mm = kMillimetersPerDegree * metrics.mae_deg;
  metrics.geometric_mean_mm = std::pow(metrics.mae_mm.prod() * rotations_as_mm.prod(), 1.0 / 6.0);
}

/// Translation of the estimate moved onto the truth by the best rotation and shift (Kabsch, no scale).
double aligned_rmse_mm(const std::vector<PosePair>& pairs) {
  Eigen::Vector3d estimated_mean = Eigen::Vector3d::Zero(), true_mean = Eigen::Vector3d::Zero();
  for (const PosePair& pair : pairs) {
    estimated_mean += pair.estimated.translation() / static_cast<double>(pairs.size());
    true_mean += pair.truth.translation() / static_cast<double>(pairs.size());
  }
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const PosePair& pair : pairs)
    covariance +=
        (pair.truth.translation() - true_mean) * (pair.estimated.translation() - estimated_mean).transpose();
  const Eigen::Matrix3d rotation = nearest_rotation(covariance);
  double sum = 0.0;
  for (const PosePair& pair : pairs)
    sum +=
        (rotation * (pair.estimated.translation() - estimated_mean) - (pair.truth.translation() - true_mean))
            .squaredNorm();
  return std::sqrt(sum / static_cast<double>(pairs.size()));
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
  // Ry Rx Rz: the middle row is (cos rx sin rz, cos rx cos rz, -sin rx), the last column (sin ry cos rx, -sin
  // rx, cos ry cos rx).
  const double cos_rx = std::hypot(r(0, 2), r(2, 2));
  const double rx = std::atan2(-r(1, 2), cos_rx);
  if (cos_rx < 1e-7) return kDegreesPerRadian * Eigen::Vector3d(rx, 0.0, std::atan2(-r(0, 1), r(0, 0)));
  return kDegreesPerRadian * Eigen::Vector3d(rx, std::atan2(r(0, 2), r(2, 2)), std::atan2(r(1, 0), r(1, 1)));
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
  TrajectoryMetrics metrics;
  for (const auto& truth : start_T_currs) metrics.touched_frames += truth.has_value() ? 1 : 0;
  metrics.compared_frames = static_cast<int>(pairs.size());
  metrics.estimated_without_touch = static_cast<int>(estimate.size() - pairs.size());
  set_axis_errors(pairs, metrics);
  double squared_sum = 0.0;
  for (const PosePair& pair : pairs)
    squared_sum += (pair.estimated.translation() - pair.truth.translation()).squaredNorm();
  metrics.ate_mm = std::sqrt(squared_sum / static_cast<double>(pairs.size()));
  metrics.ate_aligned_mm = aligned_rmse_mm(pairs);
  metrics.over_one_frame = relative_error(pairs, 1);
  metrics.over_one_second = relative_error(pairs, std::max(1, static_cast<int>(std::lround(fps))));
  const PosePair& last = pairs.back();
  metrics.final_mm = (last.estimated.translation() - last.truth.translation()).norm();
  metrics.final_deg = rotation_angle_rad(last.truth.inverse() * last.estimated) * kDegreesPerRadian;
  return metrics;
}

}  // namespace gelslam
