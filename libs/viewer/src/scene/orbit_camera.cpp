#include "gelslam/viewer/orbit_camera.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace gelslam {
namespace {

using Eigen::AngleAxisf;
using Eigen::Matrix4f;
using Eigen::Quaternionf;
using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kNearestMm = 0.05F, kFurthestMm = 1e6F;
constexpr float kZoomPerStep = 0.9F;
constexpr float kFollowTiltRad = 25.0F * kPi / 180.0F;
constexpr float kFitMargin = 1.12F;

float tangent_of_half_view() {
  return std::tan(static_cast<float>(OrbitCamera::kVerticalViewDeg) * kPi / 360.0F);
}

std::array<Vector3f, 8> corners(const Eigen::AlignedBox3f& box) {
  std::array<Vector3f, 8> result;
  for (int i = 0; i < 8; ++i)
    result[static_cast<std::size_t>(i)] = box.corner(static_cast<Eigen::AlignedBox3f::CornerType>(i));
  return result;
}

}  // namespace

void OrbitCamera::set_distance_mm(float distance_mm) {
  distance_mm_ = std::clamp(distance_mm, kNearestMm, kFurthestMm);
}

Vector3f OrbitCamera::eye_mm() const { return center_mm_ + map_R_camera_ * Vector3f(0, 0, distance_mm_); }

float OrbitCamera::mm_per_px(float depth_mm, const Viewport& viewport) const {
  return 2.0F * tangent_of_half_view() * depth_mm / static_cast<float>(std::max(viewport.height, 1));
}

void OrbitCamera::orbit(const Vector2f& movement_px, const Viewport& viewport) {
  const Vector2f angle = movement_px * (kPi / static_cast<float>(std::max(viewport.height, 1)));
  map_R_camera_ =
      (map_R_camera_ * AngleAxisf(-angle.x(), Vector3f::UnitY()) * AngleAxisf(-angle.y(), Vector3f::UnitX()))
          .normalized();
}

void OrbitCamera::pan(const Vector2f& movement_px, const Viewport& viewport) {
  const float mm = mm_per_px(distance_mm_, viewport);
  center_mm_ -= map_R_camera_ * Vector3f(movement_px.x() * mm, -movement_px.y() * mm, 0);
}

void OrbitCamera::zoom(double steps, const Vector2f& cursor_px, const Viewport& viewport) {
  const float before_mm = distance_mm_;
  set_distance_mm(before_mm * static_cast<float>(std::pow(kZoomPerStep, std::clamp(steps, -100.0, 100.0))));
  const Vector2f middle(0.5F * static_cast<float>(viewport.width),
                        0.5F * static_cast<float>(viewport.height));
  const Vector2f from_middle = cursor_px - middle;
  const float mm = mm_per_px(before_mm, viewport) * (1.0F - distance_mm_ / before_mm);
  center_mm_ += map_R_camera_ * Vector3f(from_middle.x() * mm, -from_middle.y() * mm, 0);
}

OrbitCamera OrbitCamera::fitted(std::span<const Vector3f> points_mm, const Viewport& viewport) const {
  OrbitCamera result = *this;
  const Eigen::Matrix3f camera_R_map = map_R_camera_.conjugate().toRotationMatrix();
  Eigen::AlignedBox3f box;  // Along the camera's axes.
  for (const Vector3f& point : points_mm) box.extend(camera_R_map * point);
  if (box.isEmpty()) return result;
  result.center_mm_ = map_R_camera_ * box.center();
  const float tangent_y = tangent_of_half_view(), tangent_x = tangent_y * viewport.aspect();
  float distance = 0;
  for (const Vector3f& point : points_mm) {
    const Vector3f p = camera_R_map * point - box.center();
    distance = std::max(
        distance, p.z() + kFitMargin * std::max(std::abs(p.x()) / tangent_x, std::abs(p.y()) / tangent_y));
  }
  result.set_distance_mm(std::max(distance, 1.0F));
  return result;
}

OrbitCamera OrbitCamera::fitted(const Eigen::AlignedBox3f& box_mm, const Viewport& viewport) const {
  return box_mm.isEmpty() ? *this : fitted(std::span<const Vector3f>(corners(box_mm)), viewport);
}

void OrbitCamera::look_along(const Vector3f& direction, const Vector3f& up) {
  const Vector3f back = -direction.normalized();
  Vector3f right = up.cross(back);
  if (right.norm() < 1e-4F * up.norm()) right = back.unitOrthogonal();  // The camera looks along `up`.
  right.normalize();
  Eigen::Matrix3f rotation;
  rotation << right, back.cross(right), back;
  map_R_camera_ = Quaternionf(rotation).normalized();
}

void OrbitCamera::glide_to(const OrbitCamera& goal, double dt_s, double tau_s) {
  const auto share = static_cast<float>(1.0 - std::exp(-dt_s / tau_s));
  center_mm_ += share * (goal.center_mm_ - center_mm_);
  map_R_camera_ = map_R_camera_.slerp(share, goal.map_R_camera_).normalized();
  set_distance_mm(distance_mm_ * std::pow(goal.distance_mm_ / distance_mm_, share));
}

void OrbitCamera::follow(const Pose& map_T_sensor, double dt_s, double tau_s) {
  OrbitCamera goal = *this;
  goal.center_mm_ = map_T_sensor.translation().cast<float>();
  const Vector3f looks = -(map_R_camera_ * Vector3f::UnitZ());
  const Vector3f wanted = map_T_sensor.linear().col(2).cast<float>().normalized();
  const float angle = std::atan2(looks.cross(wanted).norm(), looks.dot(wanted));
  if (angle > kFollowTiltRad) {
    Vector3f axis = looks.cross(wanted);
    // Seen from directly behind, any axis would do; the camera's own axis keeps the image upright.
    axis = axis.norm() > 1e-4F ? Vector3f(axis.normalized()) : Vector3f(map_R_camera_ * Vector3f::UnitY());
    goal.map_R_camera_ = (AngleAxisf(angle - kFollowTiltRad, axis) * map_R_camera_).normalized();
  }
  glide_to(goal, dt_s, tau_s);
}

Matrix4f OrbitCamera::camera_T_map() const {
  const Eigen::Matrix3f camera_R_map = map_R_camera_.conjugate().toRotationMatrix();
  Matrix4f result = Matrix4f::Identity();
  result.topLeftCorner<3, 3>() = camera_R_map;
  result.topRightCorner<3, 1>() = -camera_R_map * eye_mm();
  return result;
}

Matrix4f OrbitCamera::projection(float aspect, const Eigen::AlignedBox3f& box_mm) const {
  float nearest = 0.5F * distance_mm_, furthest = 2.0F * distance_mm_;
  if (!box_mm.isEmpty()) {
    const Vector3f eye = eye_mm(), back = map_R_camera_ * Vector3f::UnitZ();
    nearest = kFurthestMm, furthest = 0;
    for (const Vector3f& corner : corners(box_mm)) {
      const float depth = (eye - corner).dot(back);
      nearest = std::min(nearest, depth), furthest = std::max(furthest, depth);
    }
  }
  furthest = std::max(1.01F * furthest, 2.0F * kNearestMm);
  nearest = std::max({0.99F * nearest, 2e-4F * furthest, 0.002F * distance_mm_});
  furthest = std::max(furthest, 1.1F * nearest);
  const float f = 1.0F / tangent_of_half_view();
  Matrix4f result = Matrix4f::Zero();
  result(0, 0) = f / std::max(aspect, 1e-3F);
  result(1, 1) = f;
  result(2, 2) = -(furthest + nearest) / (furthest - nearest);
  result(2, 3) = -2.0F * furthest * nearest / (furthest - nearest);
  result(3, 2) = -1;
  return result;
}

PickRay OrbitCamera::pick_ray(const Vector2f& cursor_px, const Viewport& viewport) const {
  const float px = 2.0F * tangent_of_half_view() / static_cast<float>(std::max(viewport.height, 1));
  const Vector3f direction((cursor_px.x() - 0.5F * static_cast<float>(viewport.width)) * px,
                           (0.5F * static_cast<float>(viewport.height) - cursor_px.y()) * px, -1);
  return {eye_mm(), (map_R_camera_ * direction).normalized()};
}

}  // namespace gelslam
