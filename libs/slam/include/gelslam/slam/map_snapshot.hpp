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

/// Where a frame lies in the map, and how well that is known relative to the first keyframe of the component.
struct MapPlace {
  UncertainPose map_T_frame;
  int component = 0;  ///< of the map, in whose frame the pose is
};

/// The poses of all keyframes as estimated now. A new one replaces it whenever the pose graph has moved.
struct MapSnapshot {
  struct Node {
    int keyframe = 0;  ///< id; not every id is there
    std::int64_t frame = 0;
    int trial = 0;
    int component = 0;  ///< smallest keyframe id of the component
    Pose component_T_keyframe = Pose::Identity();
    StoredSurface surface{};
    bool placed = true;  ///< its place in the shown component is known, so that it is meshed
    // As UncertainMotion: relative to the component's first keyframe, or to the map's anchor.
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
  int shown_component = -1;       ///< of the nodes that are placed: it is meshed and drawn; -1: there is none
  GradientScale gradient_scale;   ///< of the surfaces: heights and slopes are to be divided by it
  Eigen::VectorXd scale_factors;  ///< PoseGraphSolution::shared_unknowns: motions are corrected by them
  ScaleCovariance scale_covariance = ScaleCovariance::Zero();
  std::string warning;  ///< of one that was read: that the scan went on after it was saved; or ""

  const Node* find(int keyframe) const;  ///< null when it is not there
  /// The next keyframe, where its link puts it. The first of all says how well its model's scale is known.
  void add(const NewKeyframe& added, const GradientScaleOptions& options);

  /// Where a frame lies: its motion from its keyframe, corrected by the gradient scale like every edge. This
  /// is the only place where frames are put into a map. `newer`: keyframes that the map may not have yet, in
  /// order; their links lead to it. Nothing for a frame without a keyframe, or of one that is in neither.
  std::optional<MapPlace> pose_of(const FrameRecord& frame, std::span<const NewKeyframe> newer = {}) const;

 private:
  using Located = std::pair<UncertainMotion, int>;  // in a component
  std::optional<Located> locate(int keyframe, const UncertainMotion& keyframe_T_frame,
                                std::span<const NewKeyframe> newer) const;
};

/// PoseGraphSolution::shared_unknowns as a scale; 1 where it was not estimated.
GradientScale gradient_scale_of(const Eigen::VectorXd& factors);

/// The map of a tracker alone, whose trials nothing joins: each is a component, in the frame of its first
/// frame.
class TrialMap {
 public:
  explicit TrialMap(const GradientScaleOptions& options) : options_(options) {}

  /// Every frame, in order. Where it lies; empty where nothing was tracked.
  std::optional<MapPlace> add(const TrackedFrame& frame);

 private:
  GradientScaleOptions options_;
  MapSnapshot map_;  ///< of this trial
};

}  // namespace gelslam
