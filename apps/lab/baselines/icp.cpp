#include <omp.h>
#include <open3d/pipelines/registration/Registration.h>
#include <open3d/utility/Logging.h>

#include <algorithm>
#include <utility>

#include "open3d_icp.hpp"

namespace gelslam::baselines::detail {

namespace o3d = open3d::pipelines::registration;

// omp_set_num_threads() would not suffice, because a num_threads clause overrides it.
SingleThread::SingleThread()
    : levels_before_(omp_get_max_active_levels()),
      verbosity_before_(static_cast<int>(open3d::utility::GetVerbosityLevel())) {
  omp_set_max_active_levels(0);
  open3d::utility::SetVerbosityLevel(open3d::utility::VerbosityLevel::Error);
}

SingleThread::~SingleThread() {
  omp_set_max_active_levels(levels_before_);
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

namespace gelslam {
namespace {

using namespace baselines::detail;

class Icp {
 public:
  Icp(const Surface& reference, const IcpOptions& options)
      : options_(options), cloud_(to_cloud(contact_points(reference, options.max_points))) {}

  Pose align(const Surface& target, const Pose& initial) const {
    const open3d::geometry::PointCloud target_cloud = to_cloud(contact_points(target, options_.max_points));
    if (std::min(cloud_.points_.size(), target_cloud.points_.size()) < kMinPoints) return initial;
    const SingleThread guard;
    return align_by_icp(cloud_, target_cloud, initial, options_);
  }

 private:
  IcpOptions options_;
  open3d::geometry::PointCloud cloud_;
};

}  // namespace

Registrar make_icp(const IcpOptions& options, const NormalFlowOptions& judged_by) {
  return baseline_registrar<Icp>(options, judged_by);
}

}  // namespace gelslam
