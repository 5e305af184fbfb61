#include "gelslam/loop_closure/loop_closer.hpp"
#include "gelslam/registration/relocalization.hpp"
#include "gelslam/slam/refinement.hpp"
#include "gelslam/slam/slam_options.hpp"

namespace gelslam {
namespace {

/// Lost, and not in the map.
bool unplaced(const FrameRecord& frame) { return frame.status == TrackStatus::lost && frame.keyframe < 0; }

/// The last frame of a trial and the first of the next, with contact all the time.
struct Break {
  const FrameRecord *before, *after;
};

std::vector<Break> lost_in_touch(const ScanRecord& scan) {
  std::vector<Break> breaks;
  const FrameRecord* before = nullptr;
  const std::vector<FrameRecord>& frames = scan.frames;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const FrameRecord& frame = frames[i];
    const bool follows =
        i > 0 && frame.frame == frames[i - 1].frame + 1 &&
        part_of_frame(scan.parts, frame.frame) == part_of_frame(scan.parts, frames[i - 1].frame);
    if (!follows) before = nullptr;
    if (unplaced(frame)) continue;
    if (before && frame.keyframe > before->keyframe && frame.trial == before->trial + 1)
      breaks.push_back({before, &frame});
    before = frame.keyframe >= 0 ? &frame : nullptr;
  }
  return breaks;
}

/// Where to look for the new trial's first keyframe: where the surfaces show one place; the pose of the last
/// frame where they show none (a fragment); nothing where they fit at several places.
std::optional<Pose> candidate_pose(const Keyframe& older, const Keyframe& newer, const Pose& older_T_newer,
                                   const SlamOptions& options) {
  const RegistrationResult here =
      register_normal_flow(*newer.reference.get(), *older.surface.get(), older_T_newer, options.registration);
  const RegistrationResult place =
      relocalize(*newer.reference.get(), *older.surface.get(), older_T_newer, here, options.registration,
                 options.verification, options.verification.rival_distance);
  if (place.status == RegistrationStatus::ambiguous) return std::nullopt;
  return place.ok() ? place.target_T_reference : older_T_newer;
}

}  // namespace

std::vector<PoseGraphEdge> rejoin_broken_trials(const ScanRecord& scan, const SlamOptions& options) {
  std::vector<PoseGraphEdge> found;
  for (const auto& [before, after] : lost_in_touch(scan)) {
    const auto& older = scan.keyframes[static_cast<std::size_t>(before->keyframe)];
    const auto& newer = scan.keyframes[static_cast<std::size_t>(after->keyframe)];
    if (!older || !newer) continue;
    const std::optional<Pose> pose =
        candidate_pose(*older, *newer, before->keyframe_T_frame * after->keyframe_T_frame.inverse(), options);
    if (!pose) continue;
    const auto loop = verify_loop(*older, *newer, *pose, options.registration, options.verification);
    if (loop) found.push_back(*loop);
  }
  return found;
}

}  // namespace gelslam
