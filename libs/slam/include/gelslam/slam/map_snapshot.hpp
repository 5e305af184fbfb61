#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gelslam/backend/uncertain_motion.hpp"
#include "gelslam/slam/scan_record.hpp"
#include "gelslam/slam/slam_options.hpp"
#include "gelslam/surface/stored_surface.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// Pose of a frame in the map, with its covariance relative to the first keyframe of its component.
struct MapPlace {
  UncertainPose map_T_frame;
  int component = 0;  ///< Component of the map, which defines the frame of the pose.
};

/// Poses of all keyframes at one time. Whenever the pose graph is solved again, a new snapshot replaces the
/// old one.
struct MapSnapshot {
  struct Node {
    int keyframe = 0;  ///< Keyframe id. Ids may have gaps.
    std::int64_t frame = 0;
    int trial = 0;
    int component = 0;  ///< smallest keyframe id of the component
    Pose component_T_keyframe = Pose::Identity();
    StoredSurface surface{};
    /// True if the keyframe's pose in the shown component is determined; only such keyframes are meshed.
    bool placed = true;
    // Covariance and derivative as in UncertainMotion, relative to the component's first keyframe or to the
    // map's anchor.
    Matrix6d covariance = Matrix6d::Zero();
    MotionByScale by_scale = MotionByScale::Zero();
  };
  struct Edge {
    int from = 0, to = 0;  ///< keyframe ids
    EdgeKind kind = EdgeKind::odometry;
    bool outlier = false;
    bool constrains = false;  ///< constrains_pose()
  };
  std::uint64_t version = 0;
  std::vector<Node> nodes;  ///< by id, ascending
  std::vector<Edge> edges;
  /// Component of the placed nodes, which is meshed and drawn; -1 if there is none.
  int shown_component = -1;
  /// Gradient scale of the surfaces. True heights and slopes are the stored ones divided by it.
  GradientScale gradient_scale;
  /// PoseGraphSolution::shared_unknowns, by which measured motions are corrected.
  Eigen::VectorXd scale_factors;
  ScaleCovariance scale_covariance = ScaleCovariance::Zero();
  /// For a map that was read: a warning that the scan was continued after the map was saved; or "".
  std::string warning;

  /// Returns the node of a keyframe, or null if the map does not contain it.
  const Node* find(int keyframe) const;
  /// Adds the next keyframe at the pose that its odometry edge gives. The first keyframe sets the prior
  /// covariance of the gradient scale.
  void add(const NewKeyframe& added, const GradientScaleOptions& options);

  /// Returns a frame's pose in the map: the pose of its keyframe times its motion from the keyframe,
  /// corrected by the gradient scale like every edge. This is the only function that places frames in a map.
  /// `newer` holds keyframes that the map may not contain yet, in order; their odometry edges connect them to
  /// the map. Returns nothing for a frame without a keyframe, or whose keyframe is in neither.
  std::optional<MapPlace> pose_of(const FrameRecord& frame, std::span<const NewKeyframe> newer = {}) const;

 private:
  // A motion from the component's origin, and the component.
  using Located = std::pair<UncertainMotion, int>;
  std::optional<Located> locate(int keyframe, const UncertainMotion& keyframe_T_frame,
                                std::span<const NewKeyframe> newer) const;
};

/// Returns PoseGraphSolution::shared_unknowns as a gradient scale, or 1 if it was not estimated.
GradientScale gradient_scale_of(const Eigen::VectorXd& factors);

/// The map of a tracker without loop closure: each trial is a component of its own, in the frame of its first
/// frame.
class TrialMap {
 public:
  explicit TrialMap(const GradientScaleOptions& options) : options_(options) {}

  /// Adds a frame; every frame must be passed, in order. Returns its pose in its trial, or nothing if it was
  /// not tracked.
  std::optional<MapPlace> add(const TrackedFrame& frame);

 private:
  GradientScaleOptions options_;
  MapSnapshot map_;  ///< Contains the current trial.
};

}  // namespace gelslam
