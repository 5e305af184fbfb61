#pragma once

#include <memory>
#include <vector>

#include "gelslam/frontend/keyframe.hpp"
#include "gelslam/fusion/fusion.hpp"
#include "gelslam/slam/slam_options.hpp"

namespace gelslam {

/// How well a touch fits the map at one pose.
struct MapFit {
  bool covered = false;  ///< True if the map shows enough of the touch's contact.
  /// Result of verify(), with a keyframe of the map as the reference and the touch as the target.
  RegistrationResult registration;
  int keyframe = -1;           ///< id of that keyframe
  UncertainPose map_T_sensor;  ///< Registered pose, or the given pose if registration failed.

  bool ok() const { return covered && registration.ok(); }
};

/// Surfaces at known poses, prepared for recognition and registration of touches. Immutable; all methods but
/// the constructor may be called from any thread.
class SurfaceMap {
 public:
  /// Ids of the patches must be ascending. Throws Error when no patch has enough contact. `progress` (may be
  /// null) receives the task "reading the map".
  SurfaceMap(const std::vector<PosedSurface>& patches, const SlamOptions& options,
             ProgressSink* progress = nullptr);
  ~SurfaceMap();

  int keyframe_count() const;

  /// Returns every map_T_sensor at which place recognition and verify() find the touch, best first. The same
  /// pose may come several times, from different keyframes.
  std::vector<Pose> recognize(const Keyframe& touch) const;

  /// Returns every map_T_sensor at which the map looks as it does at the pose of `fit`, which must be ok().
  /// For this, the keyframe of `fit` is itself searched for in the map, because it may show the surface
  /// better than the touch does.
  std::vector<Pose> similar_places(const MapFit& fit) const;

  /// Registers the touch to the keyframe of the map that shows most of it at `map_T_sensor`.
  MapFit fit(const NormalFlowReference& touch, const UncertainPose& map_T_sensor, PlacePrior prior) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

/// Returns the distance between two poses of a touch in mm: the larger of the distance between the two
/// positions of its center and the angle between the two orientations times kMmPerRad.
double pose_distance_mm(const Pose& map_T_a, const Pose& map_T_b, const Eigen::Vector3d& center_mm);

}  // namespace gelslam
