#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "gelslam/core/pose_graph_edge.hpp"
#include "gelslam/registration/normal_flow.hpp"
#include "gelslam/surface/stored_surface.hpp"

namespace gelslam {

/// A frame that later frames are registered to. `surface` and `reference` are large; they are stored
/// compressed and reconstructed on demand.
struct Keyframe {
  int id = 0;              ///< counts keyframes of the whole log from 0, across trials
  std::int64_t frame = 0;  ///< index in the log
  int trial = 0;
  StoredSurface surface;
  StoredReference reference;
  /// Pose in the first frame of its trial, as tracked. It is the identity for a keyframe that was loaded from
  /// a saved session, because the continued scan begins a new trial.
  Pose trial_T_keyframe = Pose::Identity();
  /// True for a frame that is kept only because it alone shows a part of the object (TurningPoints). Its pose
  /// is fixed to the keyframe to which it was registered. No frame refers to it, and it takes part in neither
  /// loops nor overlap edges, so it does not affect other poses.
  bool is_patch = false;
};

/// Returns the edge from keyframe `from` to the frame `to` that was registered to it.
PoseGraphEdge odometry_edge(int from, int to, const RegistrationResult& registration);

/// A new keyframe as the tracker returns it.
struct NewKeyframe {
  std::shared_ptr<const Keyframe> keyframe;
  /// Edge from the keyframe to which it was registered; none for the first keyframe of a trial.
  std::optional<PoseGraphEdge> edge{};
};

}  // namespace gelslam
