#pragma once

#include <open3d/geometry/PointCloud.h>

#include "baselines/baselines.hpp"
#include "contact_points.hpp"

namespace gelslam::baselines::detail {

open3d::geometry::PointCloud to_cloud(ContactPoints points);

/// Both clouds must have at least kMinPoints points. `initial` and the result are target_T_reference.
Pose align_by_icp(const open3d::geometry::PointCloud& reference, const open3d::geometry::PointCloud& target,
                  const Pose& initial, const IcpOptions& options);

/// Converts a rigid 4x4 matrix to a pose; returns `fallback` for any other matrix.
Pose to_pose(const Eigen::Matrix4d& matrix, const Pose& fallback);

}  // namespace gelslam::baselines::detail
