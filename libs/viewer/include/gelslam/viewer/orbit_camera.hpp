#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>

#include "gelslam/core/se3.hpp"

namespace gelslam {

/// Part of a framebuffer, pixels. x and y count from its lower left corner, as OpenGL's do.
struct Viewport {
  int x = 0, y = 0, width = 1, height = 1;
  float aspect() const { return static_cast<float>(width) / static_cast<float>(height); }
};

struct PickRay {
  Eigen::Vector3f origin_mm = Eigen::Vector3f::Zero();
  Eigen::Vector3f direction = Eigen::Vector3f::UnitZ();  ///< unit
};

/// A perspective camera that turns about a center, freely (no pole). Pure maths, millimeters, map frame.
/// Camera axes are OpenGL's: x right, y up, looking along -z. Cursor positions and movements are in pixels of
/// the viewport, x right and y *down* from its top left corner, as GLFW and ImGui give them (times the
/// content scale).
///
/// It starts at the map's outside view: looking along the sensor's +z with image y down, as the sensor does.
class OrbitCamera {
 public:
  static constexpr double kVerticalViewDeg = 35;

  void orbit(const Eigen::Vector2f& movement_px, const Viewport& viewport);
  /// The point in the center's plane that was under the cursor stays under it.
  void pan(const Eigen::Vector2f& movement_px, const Viewport& viewport);
  /// Positive steps come nearer; what is under the cursor in the center's plane stays there.
  void zoom(double steps, const Eigen::Vector2f& cursor_px, const Viewport& viewport);

  /// From where all of the points are in view, filling it, in the present direction. The same camera for
  /// none. For a glide there: camera.glide_to(goal, dt_s) in every frame.
  OrbitCamera fitted(std::span<const Eigen::Vector3f> points_mm, const Viewport& viewport) const;
  /// The same for the corners of a box.
  OrbitCamera fitted(const Eigen::AlignedBox3f& box_mm, const Viewport& viewport) const;
  void look_along(const Eigen::Vector3f& direction, const Eigen::Vector3f& up);
  void look_at(const Eigen::Vector3f& center_mm) { center_mm_ = center_mm; }
  void set_distance_mm(float distance_mm);

  /// Comes nearer to `goal` by the share 1 - exp(-dt/tau); same end for any frame rate.
  void glide_to(const OrbitCamera& goal, double dt_s, double tau_s = 0.15);
  /// Glides so that the touched place comes to the middle and faces the viewer, a little from the side so
  /// that texture shows. Does not twist with the sensor.
  void follow(const Pose& map_T_sensor, double dt_s, double tau_s = 0.4);

  Eigen::Vector3f center_mm() const { return center_mm_; }
  Eigen::Vector3f eye_mm() const;
  float distance_mm() const { return distance_mm_; }
  Eigen::Matrix3f map_R_camera() const { return map_R_camera_.toRotationMatrix(); }

  Eigen::Matrix4f camera_T_map() const;
  /// Depth range reaches around `box_mm`, so that nothing in it is cut off and precision is not wasted.
  Eigen::Matrix4f projection(float aspect, const Eigen::AlignedBox3f& box_mm) const;
  /// Size of a pixel at a distance along the line of sight.
  float mm_per_px(float depth_mm, const Viewport& viewport) const;
  PickRay pick_ray(const Eigen::Vector2f& cursor_px, const Viewport& viewport) const;

 private:
  Eigen::Vector3f center_mm_ = Eigen::Vector3f::Zero();
  Eigen::Quaternionf map_R_camera_{0, 1, 0, 0};  // half a turn about x: the sensor's y down, z away
  float distance_mm_ = 40;
};

}  // namespace gelslam
