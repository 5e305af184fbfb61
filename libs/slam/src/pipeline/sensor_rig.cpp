#include "gelslam/slam/sensor_rig.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "gelslam/backend/uncertain_motion.hpp"

namespace gelslam {
namespace {

constexpr double kConstraintsPerS = 5;  // neighbors in time share their errors
constexpr double kMaxGapS = 0.1;        // between two frames, to interpolate

/// A sensor's pose in one of its keyframes.
struct Place {
  int keyframe = -1;
  Pose keyframe_T_sensor = Pose::Identity();
};

/// By keyframe, how well a frame is known in it: as well as the keyframe that was tracked from it, or from
/// which it was tracked.
std::map<int, Matrix6d> frame_covariances(const ScanRecord& record) {
  std::map<int, Matrix6d> covariances;
  for (const PoseGraphEdge& edge : record.edges) {
    if (edge.kind != EdgeKind::odometry) continue;
    covariances[edge.from] = uncertain_motion(edge).covariance;
    covariances.try_emplace(edge.to, covariances[edge.from]);
  }
  return covariances;
}

bool has_place(const ScanRecord& record, const FrameRecord& frame) {
  return frame.status == TrackStatus::tracked && record.has_keyframe(frame.keyframe);
}

/// Where the sensor was at this time, between two of its frames that refer to one keyframe.
std::optional<Place> place_at(const ScanRecord& record, double time_s) {
  const std::vector<FrameRecord>& frames = record.frames;
  const auto after =
      std::lower_bound(frames.begin(), frames.end(), time_s,
                       [](const FrameRecord& frame, double time) { return frame.time_s < time; });
  if (after == frames.end() || !has_place(record, *after)) return std::nullopt;
  if (after->time_s == time_s) return Place{after->keyframe, after->keyframe_T_frame};
  if (after == frames.begin()) return std::nullopt;
  const FrameRecord& before = *std::prev(after);
  const double gap_s = after->time_s - before.time_s;
  if (!has_place(record, before) || before.trial != after->trial || gap_s > kMaxGapS) return std::nullopt;
  // A keyframe is itself the frame at which it was made, so that the frame before refers to another one.
  if (before.keyframe != after->keyframe) return std::nullopt;
  const Vector6d step = se3_log(before.keyframe_T_frame.inverse() * after->keyframe_T_frame);
  return Place{before.keyframe, before.keyframe_T_frame * se3_exp((time_s - before.time_s) / gap_s * step)};
}

}  // namespace

std::vector<RigConstraint> rig_constraints(const ScanRecord& first, const ScanRecord& second) {
  const std::map<int, Matrix6d> first_covariances = frame_covariances(first),
                                second_covariances = frame_covariances(second);
  std::vector<RigConstraint> constraints;
  std::optional<double> last_s;
  for (const FrameRecord& frame : first.frames) {
    if (!has_place(first, frame) || (last_s && frame.time_s < *last_s + 1 / kConstraintsPerS)) continue;
    const std::optional<Place> place = place_at(second, frame.time_s);
    if (!place) continue;
    const auto of_first = first_covariances.find(frame.keyframe),
               of_second = second_covariances.find(place->keyframe);
    if (of_first == first_covariances.end() || of_second == second_covariances.end()) continue;
    last_s = frame.time_s;
    constraints.push_back({frame.keyframe, place->keyframe, frame.keyframe_T_frame, place->keyframe_T_sensor,
                           of_first->second, of_second->second});
  }
  return constraints;
}

}  // namespace gelslam
