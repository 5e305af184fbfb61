#pragma once

#include <map>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "gelslam/slam/live_slam.hpp"
#include "gelslam/viewer/ui.hpp"
#include "scene/scene.hpp"

namespace gelslam::viewer::detail {

/// What is touched while it is not joined to the shown map: it grows beside the map until a loop joins it. In
/// the frame of its first keyframe that was seen apart.
class LoosePiece {
 public:
  /// Of a new map or touch; true when the shape has changed.
  bool follow(const MapSnapshot& map, const std::shared_ptr<const LiveTouch>& touch);
  /// Where it begins to lie: beside what the map shows to this camera.
  void place_beside(const Eigen::AlignedBox3f& map_box_mm, const OrbitCamera& camera);

  bool is_apart() const { return anchor_ >= 0; }
  bool is_shown() const { return map_T_anchor_.has_value(); }
  const TouchMesh& mesh() const { return mesh_; }
  const std::optional<Pose>& map_T_piece() const { return map_T_anchor_; }  ///< nothing: it is not shown
  /// Where the touch lies in the map's frame; nothing when it is not part of the piece.
  std::optional<Pose> map_T_touch() const;
  Eigen::AlignedBox3f box_mm() const;  ///< in the map's frame, with the touch

 private:
  void begin(int keyframe);
  bool grow(const MapSnapshot& map, const MapSnapshot::Node& anchor);

  int anchor_ = -1;                   ///< keyframe; -1: there is none
  std::map<int, TouchMesh> patches_;  ///< of its keyframes, each in its own frame
  std::map<int, Pose> anchor_T_keyframe_;
  TouchMesh mesh_;
  std::optional<Pose> map_T_anchor_;
  std::optional<Pose> anchor_T_touch_;
  double half_width_mm_ = 10;  ///< of the sensor
};

/// The session as a scene: takes what is new from it. Needs the window's context to be current.
class LiveScene {
 public:
  /// True when something has come that is to be drawn. `camera` shows it.
  bool take_news(LiveSession& session, const OrbitCamera& camera);
  void draw(const OrbitCamera& camera, const Viewport& viewport, const SceneStyle& style);

  Scene& scene() { return scene_; }
  const Scene& scene() const { return scene_; }
  const Texture& tactile() const { return tactile_; }
  const Texture& normals() const { return normals_; }
  const std::optional<Pose>& map_T_touch() const { return map_T_touch_; }  ///< in the map, or in the piece
  LoosePiece& piece() { return piece_; }

 private:
  struct Sample {  // of the sensor's trajectory
    int keyframe;
    Pose keyframe_T_frame;
  };

  void take_touch(const std::shared_ptr<const LiveTouch>& touch);
  void place_touch();
  void follow_piece(const OrbitCamera& camera);
  void rebuild_trajectory();

  Scene scene_;
  std::uint64_t mesh_version_ = 0;
  Texture tactile_, normals_;
  std::shared_ptr<const LiveTouch> newest_, touch_;  // as it came; on the map
  std::shared_ptr<const MapSnapshot> map_ = std::make_shared<MapSnapshot>();
  LoosePiece piece_;
  std::optional<Pose> map_T_touch_;
  bool trajectory_is_old_ = false;
  std::vector<Sample> samples_;
};

inline constexpr int kPictureWidthPx = 640;  ///< more than the panel shows, for large screens

/// The camera's picture with the border of the contact drawn over it in green: what the sensor sees, and what
/// counts as touched. BGR, kPictureWidthPx wide. A picture without a surface (before the background is known)
/// is shown as it is.
cv::Mat3b tactile_picture(const cv::Mat3b& image, const Surface* surface);

/// Normals as colors (x red, y green, z blue, as is usual), BGR, as wide; what is not touched is faded toward
/// gray.
cv::Mat3b normal_picture(const Surface& surface);

}  // namespace gelslam::viewer::detail
