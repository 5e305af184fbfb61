#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "gelslam/frontend/keyframe.hpp"

namespace gelslam {

/// Finds turning points: frames at which the motion reverses before the next keyframe is due. The surface
/// that only such a frame shows would be in no keyframe, and therefore neither in the map nor in the mesh.
/// For each frame, the class counts the points of its contact that the previous frame shows, but none of the
/// trial's last six keyframes and patches. (Points that the previous frame does not show may come from a
/// damaged image.) The frame with the most such points is returned when less than half of them are still in
/// view, when a new keyframe shows too few of them, or when the trial ends. The caller stores it as a patch,
/// which is used for the mesh only. The class is deterministic, and is not in the papers.
class TurningPoints {
 public:
  struct Touch {
    std::int64_t frame = 0;
    SurfacePtr surface;
    Pose trial_T_frame = Pose::Identity();
    /// Edge to the keyframe that the frame was registered to; stored for the caller.
    std::optional<PoseGraphEdge> edge{};
  };

  /// `min_unseen` is the minimum fraction of a frame's contact that must be in none of the trial's last
  /// keyframes.
  explicit TurningPoints(double min_unseen) : min_unseen_(min_unseen) {}

  /// Clears the state at the beginning of a trial, whose first keyframe is given.
  void begin_trial(const Touch& keyframe);

  /// Processes a tracked frame that does not become a keyframe. Returns an earlier turning point if this
  /// frame has moved away from it; the caller makes a patch of it.
  std::optional<Touch> pass(const Touch& touch);

  /// Processes a new keyframe of the trial. Returns an earlier turning point if the keyframe does not show
  /// it; as a patch it comes before this keyframe.
  std::optional<Touch> add_keyframe(const Touch& keyframe);

  /// Ends the trial. Returns the turning point that is still remembered, if any.
  std::optional<Touch> end_trial();

 private:
  struct Candidate : Touch {
    /// The unseen contact points, in the sensor frame of the trial's first frame.
    std::vector<Eigen::Vector3d> unseen_mm;
    std::size_t least = 0;  ///< Minimum number of such points for a patch.
  };

  std::vector<Eigen::Vector3d> unseen(const Touch& touch) const;
  void keep(const Touch& keyframe);
  std::optional<Touch> release();

  double min_unseen_;
  std::deque<Touch> keyframes_;  ///< The trial's last keyframes and patches.
  std::optional<Touch> before_;  ///< The previous frame or keyframe.
  std::optional<Candidate> candidate_;
};

}  // namespace gelslam
