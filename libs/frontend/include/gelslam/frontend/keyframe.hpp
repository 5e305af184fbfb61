#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "gelslam/core/pose_graph_edge.hpp"
#include "gelslam/registration/normal_flow.hpp"
#include "gelslam/surface/stored_surface.hpp"

namespace gelslam {

/// A frame that later frames are registered to. What is large is kept in compact form: `surface` and
/// `reference` are made again when they are asked for.
struct Keyframe {
  int id = 0;              ///< counts keyframes of the whole log from 0, across trials
  std::int64_t frame = 0;  ///< index in the log
  int trial = 0;
  StoredSurface surface;
  StoredReference reference;
  /// The pose in the first frame of its trial, as tracked. It is the identity for a keyframe that was read
  /// from a session: the scan goes on with another trial.
  Pose trial_T_keyframe = Pose::Identity();
  /// It is kept for the part of the object that it alone shows (TurningPoints). It is attached to the
  /// keyframe that it was registered to: no frame refers to it, no loops and overlaps are looked for, so it
  /// bends no pose.
  bool is_patch = false;
};

/// Returns the motion from a keyframe to what was registered to it.
PoseGraphEdge odometry_edge(int from, int to, const RegistrationResult& registration);

/// A keyframe as the tracker hands it out.
struct NewKeyframe {
  std::shared_ptr<const Keyframe> keyframe;
  std::optional<PoseGraphEdge> edge{};  ///< from the keyframe that it was registered to; none begins a trial
};

}  // namespace gelslam
