#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>

#include "gelslam/core/se3.hpp"

namespace gelslam {

/// Part of a framebuffer in pixels. x and y count from its lower left corner, as in OpenGL.
struct Viewport {
  int x = 0, y = 0, width = 1, height = 1;
  float aspect() const { return static_cast<float>(width) / static_cast<float>(height); }
};

struct PickRay {
  Eigen::Vector3f origin_mm = Eigen::Vector3f::Zero();
  Eigen::Vector3f direction = Eigen::Vector3f::UnitZ();  ///< unit
};

/// A perspective camera that rotates freely about a center (without poles). Pure mathematics, in mm in the
/// map frame. Camera axes are those of OpenGL: x right, y up, looking along -z. Cursor positions and
/// movements are in pixels of the viewport, x right and y *down* from its top left corner, as GLFW and ImGui
/// give them (times the content scale).
///
/// The initial view is from outside the object: along the sensor's +z axis with image y down, as the sensor
/// sees it.
class OrbitCamera {
 public:
  static constexpr double kVerticalViewDeg = 35;

  void orbit(const Eigen::Vector2f& movement_px, const Viewport& viewport);
  /// The point in the center's plane under the cursor stays there.
  void pan(const Eigen::Vector2f& movement_px, const Viewport& viewport);
  /// Positive steps move closer; the point in the center's plane under the cursor stays there.
  void zoom(double steps, const Eigen::Vector2f& cursor_px, const Viewport& viewport);

  /// Returns a camera with the same orientation that shows all points as large as possible; the same camera
  /// if there are none. To glide there, call camera.glide_to(goal, dt_s) in every frame.
  OrbitCamera fitted(std::span<const Eigen::Vector3f> points_mm, const Viewport& viewport) const;
  /// As above, for the corners of a box.
  OrbitCamera fitted(const Eigen::AlignedBox3f& box_mm, const Viewport& viewport) const;
  void look_along(const Eigen::Vector3f& direction, const Eigen::Vector3f& up);
  void look_at(const Eigen::Vector3f& center_mm) { center_mm_ = center_mm; }
  void set_distance_mm(float distance_mm);

  /// Moves toward `goal` by the fraction 1 - exp(-dt/tau), so that the speed does not depend on the frame
  /// rate.
  void glide_to(const OrbitCamera& goal, double dt_s, double tau_s = 0.15);
  /// Glides so that the touched place is in the middle and faces the viewer, slightly from the side so that
  /// texture is visible. Does not rotate with the twist of the sensor.
  void follow(const Pose& map_T_sensor, double dt_s, double tau_s = 0.4);

  Eigen::Vector3f center_mm() const { return center_mm_; }
  Eigen::Vector3f eye_mm() const;
  float distance_mm() const { return distance_mm_; }
  Eigen::Matrix3f map_R_camera() const { return map_R_camera_.toRotationMatrix(); }

  Eigen::Matrix4f camera_T_map() const;
  /// The depth range encloses `box_mm`, so that nothing in it is cut off and no precision is wasted.
  Eigen::Matrix4f projection(float aspect, const Eigen::AlignedBox3f& box_mm) const;
  /// Returns the size of a pixel at a distance along the viewing direction.
  float mm_per_px(float depth_mm, const Viewport& viewport) const;
  PickRay pick_ray(const Eigen::Vector2f& cursor_px, const Viewport& viewport) const;

 private:
  Eigen::Vector3f center_mm_ = Eigen::Vector3f::Zero();
  // Half a turn about x: the sensor's y axis points down and its z axis away from the viewer.
  Eigen::Quaternionf map_R_camera_{0, 1, 0, 0};
  float distance_mm_ = 40;
};

}  // namespace gelslam
