#include "synthetic_touch.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace gelslam::test {

Field slab(const Eigen::Vector3d& half_size_mm, double rounding_mm) {
  return [=](const Eigen::Vector3d& p) {
    const Eigen::Vector3d q = (p.cwiseAbs() - half_size_mm).array() + rounding_mm, beyond = q.cwiseMax(0.0);
    int axis = 0;
    const double inside = std::min(q.maxCoeff(&axis), 0.0);
    const Eigen::Vector3d out = inside < 0 ? Eigen::Vector3d::Unit(axis) : beyond.normalized();
    return std::pair{beyond.norm() + inside - rounding_mm, Eigen::Vector3d(out.cwiseProduct(p.cwiseSign()))};
  };
}

Pose press(const Field& field, const Eigen::Vector3d& side, double depth_mm, double twist_rad,
           const Eigen::Vector2d& offset_mm) {
  Pose pose = Pose::Identity();
  const Eigen::Vector3d z = -side.normalized();  // out of the gel toward the object
  pose.linear() =
      rotation_of_z_to(z) * Eigen::AngleAxisd(twist_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = pose.linear() * Eigen::Vector3d(offset_mm.x(), offset_mm.y(), 0);
  constexpr double far_mm = 10;
  double lowest = far_mm;
  for (double y = -7.6; y < 7.7; y += 0.2)
    for (double x = -10.1; x < 10.2; x += 0.2) {
      double height = 0;
      Eigen::Vector3d normal;
      if (follow_ray(field, pose, x, y, -far_mm, height, normal)) lowest = std::min(lowest, height);
    }
  pose.translation() += pose.linear().col(2) * (lowest + depth_mm);
  return pose;
}

SurfacePtr measured(const Field& field, const Pose& object_T_sensor) {
  const auto surface = touch(field, object_T_sensor, everywhere());
  const cv::Mat1b below = surface->contact.clone();
  const double length_px = 0.7 / kPitchMm, stiffness = 4 + 1 / (length_px * length_px);
  cv::Mat1f& height = surface->height_mm;
  const cv::Mat1f object = height.clone();
  height.setTo(0, below == 0);
  const auto in = [](int i, int length) { return std::clamp(i, 0, length - 1); };
  constexpr double kOverrelaxed = 1.85;
  for (int sweep = 0; sweep < 60; ++sweep)
    for (int v = 0; v < height.rows; ++v)
      for (int u = 0; u < height.cols; ++u) {
        const double hanging = (height(in(v - 1, height.rows), u) + height(in(v + 1, height.rows), u) +
                                height(v, in(u - 1, height.cols)) + height(v, in(u + 1, height.cols))) /
                               stiffness;
        const double next = height(v, u) + kOverrelaxed * (hanging - height(v, u));
        height(v, u) = static_cast<float>(below(v, u) ? std::min<double>(next, object(v, u)) : next);
      }
  for (int v = 0; v < height.rows; ++v)
    for (int u = 0; u < height.cols; ++u) {
      if (below(v, u) && height(v, u) > object(v, u) - 1e-4F) continue;
      surface->contact(v, u) = 0;
      const auto slope = [&](float after, float before) {
        return (before - after) / static_cast<float>(2 * kPitchMm);
      };
      const cv::Vec3f normal(slope(height(v, in(u + 1, height.cols)), height(v, in(u - 1, height.cols))),
                             slope(height(in(v + 1, height.rows), u), height(in(v - 1, height.rows), u)), 1);
      surface->normals(v, u) = normal / cv::norm(normal);
    }
  surface->contact_pixels = cv::countNonZero(surface->contact);
  return surface;
}

PosedSurface with_errors(int id, const Field& field, const Pose& object_T_sensor, const Errors& errors,
                         std::mt19937_64& random) {
  auto surface = std::make_shared<Surface>(*measured(field, object_T_sensor));
  cv::Mat1f noise;
  cv::extractChannel(noise_field(surface->height_mm.size(), 6.0, random()), noise, 0);
  surface->height_mm = surface->height_mm * (1.0 + errors.height_gain * normal_deviate(random)) +
                       errors.height_noise_mm * noise;
  Vector6d wrong;
  for (int i = 0; i < 6; ++i)
    wrong[i] = normal_deviate(random) * (i < 3 ? errors.rotation_rad : errors.translation_mm);
  return {id, object_T_sensor * se3_exp(wrong), SurfacePtr(surface)};
}

std::vector<PosedSurface> roll(const Field& field, int n, double half_length_mm, double depth_mm,
                               const Errors& errors, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<PosedSurface> patches;
  for (int i = 0; i < n; ++i) {
    const double turn = 2 * std::numbers::pi * i / n;
    const double lean = 0.9 * std::sin(5 * turn + 0.3) * half_length_mm;  // toward one end and the other
    const Eigen::Vector3d side(std::sin(lean), std::cos(lean) * std::cos(turn),
                               std::cos(lean) * std::sin(turn));
    patches.push_back(with_errors(i, field, press(field, side, depth_mm, 0.3 * i), errors, random));
  }
  return patches;
}

}  // namespace gelslam::test
