#include "open3d_icp.hpp"

#include <omp.h>
#include <open3d/pipelines/registration/Registration.h>
#include <open3d/utility/Logging.h>

#include <utility>

namespace gelslam::baselines::detail {

namespace o3d = open3d::pipelines::registration;

// omp_set_num_threads() would not do: a num_threads clause overrules it.
SingleThread::SingleThread() : levels_before_(omp_get_max_active_levels()) { omp_set_max_active_levels(0); }

SingleThread::~SingleThread() { omp_set_max_active_levels(levels_before_); }

QuietSingleThread::QuietSingleThread()
    : verbosity_before_(static_cast<int>(open3d::utility::GetVerbosityLevel())) {
  open3d::utility::SetVerbosityLevel(open3d::utility::VerbosityLevel::Error);
}

QuietSingleThread::~QuietSingleThread() {
  open3d::utility::SetVerbosityLevel(static_cast<open3d::utility::VerbosityLevel>(verbosity_before_));
}

open3d::geometry::PointCloud to_cloud(ContactPoints points) {
  open3d::geometry::PointCloud cloud;
  cloud.points_ = std::move(points.position_mm);
  cloud.normals_ = std::move(points.normal);
  return cloud;
}

Pose to_pose(const Eigen::Matrix4d& matrix, const Pose& fallback) {
  if (!matrix.allFinite()) return fallback;
  Pose pose;
  pose.matrix() = matrix;
  return normalized(pose);
}

Pose align_by_icp(const open3d::geometry::PointCloud& reference, const open3d::geometry::PointCloud& target,
                  const Pose& initial, const IcpOptions& options) {
  const o3d::RegistrationResult found =
      o3d::RegistrationICP(reference, target, options.max_distance_mm, initial.matrix(),
                           o3d::TransformationEstimationPointToPlane(),
                           o3d::ICPConvergenceCriteria(options.relative_tolerance, options.relative_tolerance,
                                                       options.max_iterations));
  return to_pose(found.transformation_, initial);
}

}  // namespace gelslam::baselines::detail
