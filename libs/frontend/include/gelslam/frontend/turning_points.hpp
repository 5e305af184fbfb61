#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "gelslam/frontend/keyframe.hpp"

namespace gelslam {

/// Finds the frames at which a motion turns back before a keyframe is due: what only they have shown would be
/// in no keyframe, and so neither in the map nor in the mesh. It keeps the frame that shows most of what the
/// trial's last keyframes do not, until it is seen no more. What the frame before does not show either may be
/// damage of one picture, and does not count. Deterministic. Source: own.
class TurningPoints {
 public:
  struct Touch {
    std::int64_t frame = 0;
    SurfacePtr surface;
    Pose trial_T_frame = Pose::Identity();
    std::optional<PoseGraphEdge> edge{};  ///< only passed through
  };

  /// `min_unseen` is the share of its contact that a frame must have shown alone.
  explicit TurningPoints(double min_unseen) : min_unseen_(min_unseen) {}

  /// Forgets all, because a trial begins with this keyframe.
  void begin_trial(const Touch& keyframe);

  /// Takes the next tracked frame of the trial. Returns a turning point that this frame has left behind,
  /// which is a patch from now on.
  std::optional<Touch> pass(const Touch& touch);

  /// Takes a keyframe of the trial. Returns a turning point that it does not show; it comes before this
  /// keyframe.
  std::optional<Touch> add_keyframe(const Touch& keyframe);

  /// Ends the trial. Returns a turning point that was not left behind yet.
  std::optional<Touch> end_trial();

 private:
  struct Candidate : Touch {
    std::vector<Eigen::Vector3d> unseen_mm;  ///< in the trial's frame
    std::size_t least = 0;                   ///< as many of them justify a patch
  };

  std::vector<Eigen::Vector3d> unseen(const Touch& touch) const;
  void keep(const Touch& keyframe);
  std::optional<Touch> release();

  double min_unseen_;
  std::deque<Touch> keyframes_;  ///< the trial's last, and its patches
  std::optional<Touch> before_;  ///< the last frame, or keyframe
  std::optional<Candidate> candidate_;
};

}  // namespace gelslam
