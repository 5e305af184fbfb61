#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "gelslam/slam/live_session.hpp"
#include "gelslam/viewer/scene.hpp"
#include "gelslam/viewer/ui.hpp"
#include "live/loose_piece.hpp"

namespace gelslam::viewer::detail {

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
  const std::optional<TouchPatch>& touch() const { return placed_; }  ///< in the map, or in the piece
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
  std::optional<TouchPatch> placed_;
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
