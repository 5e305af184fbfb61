#pragma once

#include <map>
#include <memory>
#include <optional>

#include "gelslam/slam/live_slam.hpp"
#include "gelslam/viewer/orbit_camera.hpp"
#include "scene/scene_touch.hpp"

namespace gelslam::viewer::detail {

/// What is touched while it is not joined to the shown map: it grows beside the map until a loop joins it. In
/// the frame of its first keyframe that was seen apart.
class UnjoinedPreview {
 public:
  /// Of a new map or touch; true when the shape has changed.
  /// `place`: the touch's; null or none without contact.
  bool follow(const MapSnapshot& map, const FrameReport* touch, const std::optional<MapPlace>& place);
  /// Where it begins to lie: beside what the map shows to this camera.
  void place_beside(const Eigen::AlignedBox3f& map_box_mm, const OrbitCamera& camera);

  bool is_apart() const { return anchor_ >= 0; }
  bool is_shown() const { return map_T_anchor_.has_value(); }
  const TouchMesh& mesh() const { return mesh_; }
  const std::optional<Pose>& map_T_unjoined() const { return map_T_anchor_; }  ///< nothing: it is not shown
  /// Where the touch lies in the map's frame; nothing when it is not part of the component.
  std::optional<Pose> map_T_touch() const;
  Eigen::AlignedBox3f box_mm() const;  ///< in the map's frame, with the touch

 private:
  bool grow(const MapSnapshot& map, const MapSnapshot::Node& anchor);

  int anchor_ = -1;                   ///< keyframe; -1: there is none
  std::map<int, TouchMesh> patches_;  ///< of its keyframes, each in its own frame
  std::map<int, Pose> anchor_T_keyframe_;
  TouchMesh mesh_;
  std::optional<Pose> map_T_anchor_;
  std::optional<Pose> anchor_T_touch_;
  double half_width_mm_ = 10;  ///< of the sensor
};

}  // namespace gelslam::viewer::detail
