#include "gelslam/slam/tum.hpp"

#include <fmt/core.h>

namespace gelslam {

std::string tum_line(double time_s, const Pose& pose_mm) {
  Eigen::Quaterniond q(pose_mm.linear());
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const Eigen::Vector3d t = pose_mm.translation() * 1e-3;
  return fmt::format("{:.12g} {:.12g} {:.12g} {:.12g} {:.12g} {:.12g} {:.12g} {:.12g}\n", time_s, t.x(),
                     t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

std::string tum_text(const std::vector<StampedPose>& trajectory) {
  std::string text;
  for (const StampedPose& pose : trajectory) text += tum_line(pose.time_s, pose.map_T_sensor);
  return text;
}

}  // namespace gelslam
