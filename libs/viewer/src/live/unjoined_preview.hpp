#pragma once

#include <map>
#include <optional>

#include "gelslam/slam/live_slam.hpp"
#include "gelslam/viewer/orbit_camera.hpp"
#include "scene/scene_touch.hpp"

namespace gelslam::viewer::detail {

/// Preview of a component that is not joined to the shown map yet. It is shown beside the map until a loop
/// joins it. Its frame is that of its first keyframe that was not in the map.
class UnjoinedPreview {
 public:
  /// Processes a new map or touch. Returns true if the shape has changed. `place` is the pose of the touch.
  /// `touch` may be null, and `place` is empty without contact.
  bool follow(const MapSnapshot& map, const FrameReport* touch, const std::optional<MapPlace>& place);
  /// Sets its initial position, beside the map as this camera sees it.
  void place_beside(const Eigen::AlignedBox3f& map_box_mm, const OrbitCamera& camera);

  bool is_apart() const { return anchor_ >= 0; }
  bool is_shown() const { return map_T_anchor_.has_value(); }
  const TouchMesh& mesh() const { return mesh_; }
  /// Empty if it is not shown.
  const std::optional<Pose>& map_T_unjoined() const { return map_T_anchor_; }
  /// Returns the pose of the touch in the map's frame; nothing if the touch does not belong to the component.
  std::optional<Pose> map_T_touch() const;
  Eigen::AlignedBox3f box_mm() const;  ///< In the map's frame, including the touch.

 private:
  bool grow(const MapSnapshot& map, const MapSnapshot::Node& anchor);

  int anchor_ = -1;                   ///< Id of the keyframe that defines its frame; -1 if there is none.
  std::map<int, TouchMesh> patches_;  ///< Surfaces of its keyframes, each in its own frame.
  std::map<int, Pose> anchor_T_keyframe_;
  TouchMesh mesh_;
  std::optional<Pose> map_T_anchor_;
  std::optional<Pose> anchor_T_touch_;
  double half_width_mm_ = 10;  ///< Of the sensor.
};

}  // namespace gelslam::viewer::detail
