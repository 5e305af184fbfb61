#pragma once

#include <optional>
#include <vector>

#include "gelslam/core/se3.hpp"

namespace gelslam {

/// One degree in millimeters where rotations and translations are averaged together (lever arm of 5 mm).
constexpr double kMillimetersPerDegree = 0.087;

/// Angles (rx, ry, rz) in degrees with R = Ry(ry) Rx(rx) Rz(rz): extrinsic zxy, as scipy's as_euler('zxy')
/// (which returns them in the order z, x, y). rx is in [-90, 90]; at +-90 only ry -+ rz is determined, and ry
/// is set to 0.
Eigen::Vector3d euler_zxy_deg(const Eigen::Matrix3d& rotation);

/// Returns estimate minus truth: x y z in mm, then euler_zxy_deg() wrapped to +-180 degrees, as in NormalFlow
/// (Huang et al., RA-L 2024).
Vector6d axis_error(const Pose& estimated, const Pose& truth);

/// Returns the geometric mean of six mean absolute errors, where a degree counts as kMillimetersPerDegree.
double geometric_mean_mm(const Vector6d& errors);

/// A pose of the estimate, with its index in the list of true poses.
struct IndexedPose {
  int index = 0;
  Pose map_T_sensor = Pose::Identity();
};

/// Root mean square error of the motion over a fixed number of frames.
struct RelativePoseError {
  int pairs = 0;
  double translation_mm = 0.0;
  double rotation_deg = 0.0;
};

struct TrajectoryMetrics {
  int touched_frames = 0;   ///< Frames with a true pose.
  int compared_frames = 0;  ///< Frames with both a true and an estimated pose.
  /// Estimates in frames without contact according to the truth; they are not evaluated.
  int estimated_without_touch = 0;
  Eigen::Vector3d mae_mm = Eigen::Vector3d::Zero();   ///< mean |x|, |y|, |z| of the difference
  Eigen::Vector3d mae_deg = Eigen::Vector3d::Zero();  ///< mean |wrapped difference| of rx, ry, rz
  /// Geometric mean of the six errors; a degree counts as kMillimetersPerDegree.
  double geometric_mean_mm = 0.0;
  /// RMSE of the translation, with both trajectories at identity at the reference frame.
  double ate_mm = 0.0;
  double ate_aligned_mm = 0.0;  ///< RMSE of the translation after the best rigid alignment.
  /// RMSE of the rotation angle between both, with both at identity at the reference frame.
  double rotation_rmse_deg = 0.0;
  RelativePoseError over_one_frame;
  RelativePoseError over_one_second;
  double final_mm = 0.0;  ///< Translation error at the last compared frame.
  double final_deg = 0.0;

  double tracked_share() const { return static_cast<double>(compared_frames) / touched_frames; }
};

/// Returns the index at which both trajectories are set to identity: `preferred` if both have a pose there,
/// else the first index at which both have one. Throws Error when there is none.
int choose_reference_index(const std::vector<IndexedPose>& estimate,
                           const std::vector<std::optional<Pose>>& start_T_currs,
                           std::optional<int> preferred);

/// Compares poses relative to the frame at `reference_index`, where both must have a pose. Indices must be
/// ascending and within the truth. See axis_error(); ATE and RPE as in Sturm et al. 2012.
TrajectoryMetrics evaluate_trajectory(const std::vector<IndexedPose>& estimate,
                                      const std::vector<std::optional<Pose>>& start_T_currs,
                                      int reference_index, double fps);

}  // namespace gelslam
