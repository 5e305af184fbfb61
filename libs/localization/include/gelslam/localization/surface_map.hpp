#pragma once

#include <memory>
#include <vector>

#include "gelslam/frontend/keyframe.hpp"
#include "gelslam/fusion/fusion.hpp"
#include "gelslam/slam/slam_options.hpp"

namespace gelslam {

/// How well a touch fits the map at one pose.
struct MapFit {
  bool covered = false;  ///< the map shows enough of what the touch shows
  RegistrationResult
      registration;            ///< verify(): a keyframe of the map is the reference, the touch the target
  int keyframe = -1;           ///< id of that keyframe
  UncertainPose map_T_sensor;  ///< as registered, or the given one where registration failed

  bool ok() const { return covered && registration.ok(); }
};

/// Surfaces at known poses, made ready for touches to be found in them. Immutable; all but the constructor
/// may be called from any thread.
class SurfaceMap {
 public:
  /// Ids of the patches must grow. Throws Error when there is none, or none has contact. `progress`
  /// (may be null) receives the task "reading the map".
  SurfaceMap(const std::vector<PosedSurface>& patches, const SlamOptions& options,
             ProgressSink* progress = nullptr);
  ~SurfaceMap();

  int keyframe_count() const;

  /// Every map_T_sensor at which place recognition and verify() find the touch, the best first; the same pose
  /// may come several times, from different keyframes.
  std::vector<Pose> recognize(const Keyframe& touch) const;

  /// Every map_T_sensor at which the map looks as it does at the pose of `fit`, which must be ok(): the
  /// places that its keyframe, which shows the surface better than a touch may, is recognized at.
  std::vector<Pose> similar_places(const MapFit& fit) const;

  /// Registers the touch to the keyframe of the map that shows most of it at `map_T_sensor`.
  MapFit fit(const NormalFlowReference& touch, const UncertainPose& map_T_sensor, PlacePrior prior) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

/// Where two poses put the touch, compared: the shift of its center or, if that is more, the turn
/// (kMmPerRad).
double pose_distance_mm(const Pose& map_T_a, const Pose& map_T_b, const Eigen::Vector3d& center_mm);

}  // namespace gelslam
