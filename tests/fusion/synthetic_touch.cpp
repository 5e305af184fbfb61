#include "synthetic_touch.hpp"

#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/se3.hpp"

namespace gelslam::test {
namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr double kPitchMm = 0.0634;

/// The point of height z on the sensor's ray that meets z = 0 at (x, y).
Eigen::Vector3d on_ray(double x, double y, double z, double camera_distance_mm) {
  const double stretch = camera_distance_mm > 0 ? 1 + z / camera_distance_mm : 1;
  return {stretch * x, stretch * y, z};
}

/// First z at which that ray meets the object, coming from below; `limit` when it does not.
double first_hit(const Shape& shape, const Pose& object_T_sensor, double x, double y, double start,
                 double limit, double camera_distance_mm = 0) {
  const double length =
      camera_distance_mm > 0 ? std::sqrt(1 + (x * x + y * y) / (camera_distance_mm * camera_distance_mm)) : 1;
  double z = start;
  for (int step = 0; step < 200 && z < limit; ++step) {
    const double d = shape(object_T_sensor * on_ray(x, y, z, camera_distance_mm));
    if (d < 1e-4) return z;
    z += d / length;
  }
  return limit;
}

Eigen::Vector3d gradient_at(const Shape& shape, const Eigen::Vector3d& p) {
  constexpr double step = 1e-4;
  Eigen::Vector3d gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d offset = step * Eigen::Vector3d::Unit(axis);
    gradient[axis] = (shape(p + offset) - shape(p - offset)) / (2 * step);
  }
  return gradient;
}

}  // namespace

Shape sphere(double radius_mm) {
  return [=](const Eigen::Vector3d& p) { return p.norm() - radius_mm; };
}

Shape slab(const Eigen::Vector3d& half_size_mm, double rounding_mm) {
  return [=](const Eigen::Vector3d& p) {
    const Eigen::Vector3d q = (p.cwiseAbs() - half_size_mm).array() + rounding_mm;
    return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0) - rounding_mm;
  };
}

Shape bumpy_ellipsoid(double half_length_mm, double radius_mm, double bump_mm) {
  return [=](const Eigen::Vector3d& p) {
    const Eigen::Vector3d q(p.x() / half_length_mm, p.y() / radius_mm, p.z() / radius_mm);
    const double bumps =
        bump_mm * std::sin(2.1 * p.x()) * std::sin(1.9 * p.y() + 0.5) * std::sin(2.3 * p.z() + 1.0);
    // The scaled norm's gradient is at most 1/radius, the bumps' at most 3.7 bump: 0.6 keeps tracing safe.
    return 0.6 * ((q.norm() - 1.0) * std::min(radius_mm, half_length_mm) + bumps);
  };
}

Eigen::Vector3d outward_normal(const Shape& shape, const Eigen::Vector3d& p) {
  return gradient_at(shape, p).normalized();
}

double surface_distance(const Shape& shape, const Eigen::Vector3d& p) {
  return shape(p) / std::max(gradient_at(shape, p).norm(), 1e-9);
}

double Gaussian::operator()() {
  const auto uniform = [&] { return (static_cast<double>(engine_() >> 11) + 0.5) / 9007199254740992.0; };
  const double radius = std::sqrt(-2.0 * std::log(uniform()));
  return radius * std::cos(2.0 * std::numbers::pi * uniform());
}

Pose press(const Shape& shape, const Eigen::Vector3d& side, double depth_mm, double twist_rad,
           const Eigen::Vector2d& offset_mm) {
  Pose pose = Pose::Identity();
  const Eigen::Vector3d z = -side.normalized();  // out of the gel toward the object
  pose.linear() =
      rotation_of_z_to(z) * Eigen::AngleAxisd(twist_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = pose.linear() * Eigen::Vector3d(offset_mm.x(), offset_mm.y(), 0);
  constexpr double far_mm = 100;
  double lowest = far_mm;
  for (double y = -7.6; y < 7.7; y += 0.2) {
    for (double x = -10.1; x < 10.2; x += 0.2)
      lowest = std::min(lowest, first_hit(shape, pose, x, y, -far_mm, far_mm));
  }
  pose.translation() += pose.linear().col(2) * (lowest + depth_mm);
  return pose;
}

SurfacePtr touch(const Shape& shape, const Pose& object_T_sensor, int rim_px, double camera_distance_mm) {
  auto surface = std::make_shared<Surface>();
  surface->pixel_pitch_mm = kPitchMm;
  surface->optics.camera_distance_mm = camera_distance_mm;
  surface->height_mm.create(kHeight, kWidth);
  surface->normals.create(kHeight, kWidth);
  surface->contact.create(kHeight, kWidth);
  surface->curvature = cv::Mat1f::zeros(kHeight, kWidth);
  surface->normals = cv::Vec3f(0, 0, 1);
  const Eigen::Matrix3d sensor_R_object = object_T_sensor.linear().transpose();
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const double x = (u - 0.5 * (kWidth - 1)) * kPitchMm, y = (v - 0.5 * (kHeight - 1)) * kPitchMm;
      const double z = first_hit(shape, object_T_sensor, x, y, -5.0, 0.0, camera_distance_mm);
      surface->contact(v, u) = z < 0 ? 255 : 0;
      surface->height_mm(v, u) = static_cast<float>(z);
      if (z >= 0) continue;
      const Eigen::Vector3d n =
          -sensor_R_object * outward_normal(shape, object_T_sensor * on_ray(x, y, z, camera_distance_mm));
      surface->normals(v, u) =
          cv::Vec3f(static_cast<float>(n.x()), static_cast<float>(n.y()), static_cast<float>(n.z()));
    }
  }
  // The gel cannot follow a steep flank: around the contact it hangs from its border, and the mask takes some
  // of it in.
  if (rim_px > 0) {
    const cv::Mat kernel = cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * rim_px + 1, 2 * rim_px + 1});
    const cv::Mat1b true_contact = surface->contact.clone();
    cv::dilate(true_contact, surface->contact, kernel);
    cv::Mat1f hanging;
    cv::GaussianBlur(surface->height_mm, hanging, {0, 0}, 6.0);
    hanging.copyTo(surface->height_mm, true_contact == 0);
  }
  surface->contact_pixels = cv::countNonZero(surface->contact);
  return surface;
}

PosedSurface with_errors(int id, const Shape& shape, const Pose& object_T_sensor, const Errors& errors,
                         Gaussian& noise) {
  auto surface = std::make_shared<Surface>(*touch(shape, object_T_sensor));
  surface->height_mm = surface->height_mm * (1.0 + errors.height_gain * noise());
  if (errors.height_noise_mm > 0) {
    constexpr double blur_px = 3.0;
    cv::Mat1f white(surface->height_mm.size());
    for (float& w : white) w = static_cast<float>(noise());
    cv::GaussianBlur(white, white, {0, 0}, blur_px);
    // Blurring white noise divides its deviation by 2 sqrt(pi) sigma.
    surface->height_mm += white * (errors.height_noise_mm * 2.0 * std::sqrt(std::numbers::pi) * blur_px);
  }
  Vector6d wrong;
  for (int i = 0; i < 6; ++i) wrong[i] = noise() * (i < 3 ? errors.rotation_rad : errors.translation_mm);
  return {id, object_T_sensor * se3_exp(wrong), SurfacePtr(surface)};
}

std::vector<PosedSurface> roll(const Shape& shape, int n, double half_length_mm, double depth_mm,
                               const Errors& errors, std::uint64_t seed) {
  Gaussian noise(seed);
  std::vector<PosedSurface> patches;
  for (int i = 0; i < n; ++i) {
    const double turn = 2 * std::numbers::pi * i / n;
    const double lean = 0.9 * std::sin(5 * turn + 0.3) * half_length_mm;  // toward one end and the other
    const Eigen::Vector3d side(std::sin(lean), std::cos(lean) * std::cos(turn),
                               std::cos(lean) * std::sin(turn));
    patches.push_back(with_errors(i, shape, press(shape, side, depth_mm, 0.3 * i), errors, noise));
  }
  return patches;
}

}  // namespace gelslam::test
