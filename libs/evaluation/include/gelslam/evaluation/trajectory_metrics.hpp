#pragma once

#include <optional>
#include <vector>

#include "gelslam/core/se3.hpp"

namespace gelslam {

/// One degree in millimeters when rotations and translations are averaged together (a lever arm of 5 mm).
constexpr double kMillimetersPerDegree = 0.087;

/// Angles (rx, ry, rz) in degrees with R = Ry(ry) Rx(rx) Rz(rz): extrinsic zxy, as scipy's as_euler('zxy')
/// (which returns them in the order z, x, y). rx is in [-90, 90]; at +-90 only ry -+ rz is determined, and ry
/// is set to 0.
Eigen::Vector3d euler_zxy_deg(const Eigen::Matrix3d& rotation);

/// Estimate less truth: x y z in mm, then euler_zxy_deg(), wrapped to +-180 degrees. Source: NormalFlow
/// (Huang et al., RA-L 2024).
Vector6d axis_error(const Pose& estimated, const Pose& truth);

/// Of six mean absolute errors, a degree counted as kMillimetersPerDegree.
double geometric_mean_mm(const Vector6d& errors);

/// A pose of the estimate at an index of the truth's list.
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
  int touched_frames = 0;           ///< frames with a true pose
  int compared_frames = 0;          ///< of those, frames with an estimate
  int estimated_without_touch = 0;  ///< estimates where truth says that nothing touches (not judged)
  Eigen::Vector3d mae_mm = Eigen::Vector3d::Zero();   ///< mean |x|, |y|, |z| of the difference
  Eigen::Vector3d mae_deg = Eigen::Vector3d::Zero();  ///< mean |wrapped difference| of rx, ry, rz
  double geometric_mean_mm = 0.0;  ///< of the six, a degree counted as kMillimetersPerDegree
  double ate_mm = 0.0;             ///< RMSE of translation, both starting at identity at the reference frame
  double ate_aligned_mm = 0.0;     ///< RMSE of translation after the best rigid alignment
  double rotation_rmse_deg = 0.0;  ///< RMSE of the angle between the two, both starting as above
  RelativePoseError over_one_frame;
  RelativePoseError over_one_second;
  double final_mm = 0.0;  ///< at the last compared frame
  double final_deg = 0.0;

  double tracked_share() const { return static_cast<double>(compared_frames) / touched_frames; }
};

/// The index at which both trajectories are set to identity: `preferred` where both know it, else the first
/// index that both know. Throws Error when there is none.
int choose_reference_index(const std::vector<IndexedPose>& estimate,
                           const std::vector<std::optional<Pose>>& start_T_currs,
                           std::optional<int> preferred);

/// Compares poses relative to the frame at `reference_index`, which both must know. Indices increase and are
/// within the truth. Source: axis_error(); ATE and RPE as in Sturm et al. 2012.
TrajectoryMetrics evaluate_trajectory(const std::vector<IndexedPose>& estimate,
                                      const std::vector<std::optional<Pose>>& start_T_currs,
                                      int reference_index, double fps);

}  // namespace gelslam
