#include "pipeline/frame_correction.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace gelslam::slam::detail {
namespace {

/// From a keyframe to the next one.
struct Link {
  Vector6d motion = Vector6d::Zero();      ///< as measured
  Vector6d correction = Vector6d::Zero();  ///< measured * exp(correction) is what corrected surfaces say
};

Link link_of(const Pose& measured, const Pose& corrected) {
  return {se3_log(measured), se3_log(measured.inverse() * corrected)};
}

/// Of motions, so that a radian counts as much as what it moves at half a contact's size from its middle.
double dot(const Vector6d& a, const Vector6d& b) {
  constexpr double kMmPerRad = 5.0;
  return kMmPerRad * kMmPerRad * a.head<3>().dot(b.head<3>()) + a.tail<3>().dot(b.tail<3>());
}

/// How much of the link's motion this one is; less where it leads elsewhere.
double share_of(const Vector6d& motion, const Link& link) {
  constexpr double kLeastMotion2 = 0.1 * 0.1;  // below 0.1 mm there is no direction to speak of
  const double along = dot(motion, link.motion), link2 = dot(link.motion, link.motion),
               motion2 = dot(motion, motion);
  if (link2 < kLeastMotion2 || motion2 < kLeastMotion2) return 0.0;
  const double alike = along * along / (link2 * motion2);
  return std::clamp(alike * along / link2, 0.0, 1.0);
}

}  // namespace

void share_out_corrections(const std::vector<PoseGraphEdge>& measured,
                           const std::vector<PoseGraphEdge>& corrected, std::vector<FrameRecord>& frames) {
  std::map<std::pair<int, int>, const PoseGraphEdge*> links;
  for (const PoseGraphEdge& edge : corrected)
    if (edge.kind == EdgeKind::odometry) links[{edge.from, edge.to}] = &edge;
  std::map<int, std::vector<Link>> onward;  // to the next keyframe, and to turning points
  for (const PoseGraphEdge& edge : measured) {
    const auto link = links.find({edge.from, edge.to});
    if (edge.kind == EdgeKind::odometry && link != links.end())
      onward[edge.from].push_back(link_of(edge.from_T_to, link->second->from_T_to));
  }
  for (FrameRecord& frame : frames) {
    const auto links = onward.find(frame.keyframe);
    if (links == onward.end()) continue;
    const Vector6d motion = se3_log(frame.keyframe_T_frame);
    double share = 0;
    Vector6d correction = Vector6d::Zero();
    for (const Link& link : links->second)
      if (const double of_this = share_of(motion, link); of_this > share) {
        share = of_this;
        correction = link.correction;
      }
    frame.keyframe_T_frame = frame.keyframe_T_frame * se3_exp(share * correction);
  }
}

}  // namespace gelslam::slam::detail
