#include "analytic_surface.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace gelslam::test {

Field sphere(double radius_mm) {
  return [radius_mm](const Eigen::Vector3d& p) {
    return std::pair{p.norm() - radius_mm, Eigen::Vector3d(p.normalized())};
  };
}

Field cylinder(double radius_mm) {
  return [radius_mm](const Eigen::Vector3d& p) {
    const double r = std::hypot(p.y(), p.z());
    return std::pair{r - radius_mm, Eigen::Vector3d(0, p.y() / r, p.z() / r)};
  };
}

Field extruded_edge() {
  return [](const Eigen::Vector3d& p) {
    const double root = std::hypot(p.y(), 0.4);
    return std::pair{p.z() - (0.3 * root + 0.1 * p.y()), Eigen::Vector3d(0, -(0.3 * p.y() / root + 0.1), 1)};
  };
}

Field coin_face() {
  struct Stroke {
    Eigen::Vector2d from, to;
  };
  const std::vector<Stroke> strokes = {{{-4, -2}, {-2.5, 2}},  {{-2.5, 2}, {-1, -2}}, {{0.5, -1.5}, {0.5, 2}},
                                       {{0.5, 0.2}, {2, 0.2}}, {{3, -2}, {4.5, -1}},  {{3.2, 1}, {4.2, 2.2}}};
  constexpr double kHeightMm = 0.12, kWidthMm = 0.25;
  return [strokes](const Eigen::Vector3d& p) {
    double height = 0;
    Eigen::Vector2d slope = Eigen::Vector2d::Zero();
    for (const Stroke& s : strokes) {
      const Eigen::Vector2d along = s.to - s.from;
      const double t = std::clamp((p.head<2>() - s.from).dot(along) / along.squaredNorm(), 0.0, 1.0);
      const Eigen::Vector2d off = p.head<2>() - (s.from + t * along);
      const double bump = kHeightMm * std::exp(-0.5 * off.squaredNorm() / (kWidthMm * kWidthMm));
      height += bump;
      slope -= bump / (kWidthMm * kWidthMm) * off;
    }
    return std::pair{p.z() + height, Eigen::Vector3d(slope.x(), slope.y(), 1)};
  };
}

Field waffle(double period_mm) {
  return [k = 2 * M_PI / period_mm](const Eigen::Vector3d& p) {
    constexpr double a = 0.03;
    return std::pair{p.z() - a * (std::cos(k * p.x()) + std::cos(k * p.y())),
                     Eigen::Vector3d(a * k * std::sin(k * p.x()), a * k * std::sin(k * p.y()), 1)};
  };
}

Field together(const Field& one, const Field& other) {
  return [one, other](const Eigen::Vector3d& p) {
    const auto [a, da] = one(p);
    const auto [b, db] = other(p);
    return std::pair{a + b - p.z(), Eigen::Vector3d(da + db - Eigen::Vector3d::UnitZ())};
  };
}

Field plane() {
  return [](const Eigen::Vector3d& p) { return std::pair{p.z(), Eigen::Vector3d(0, 0, 1)}; };
}

std::pair<double, Eigen::Vector3d> Waves::operator()(const Eigen::Vector3d& p) const {
  std::pair<double, Eigen::Vector3d> sum{0.0, Eigen::Vector3d::Zero()};
  for (const Wave& w : waves) {
    const double angle = w.k.dot(p) + w.phase;
    sum.first += w.amplitude_mm * std::cos(angle);
    sum.second -= w.amplitude_mm * std::sin(angle) * w.k;
  }
  return sum;
}

Waves random_waves(std::uint64_t seed, double slope, double shortest_mm, double longest_mm, bool flat,
                   int count) {
  std::mt19937_64 random(seed);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  Waves result;
  for (int i = 0; i < count; ++i) {
    const double k = 2 * M_PI / (shortest_mm + (longest_mm - shortest_mm) * uniform()),
                 around = 2 * M_PI * uniform();
    const double up = flat ? 0.0 : 2 * uniform() - 1, flat_part = std::sqrt(1 - up * up);
    result.waves.push_back(
        {k * Eigen::Vector3d(flat_part * std::cos(around), flat_part * std::sin(around), up),
         2 * M_PI * uniform(), slope * std::sqrt(2.0 / count) / k});
  }
  return result;
}

Field relief(const Waves& waves) {
  return [waves](const Eigen::Vector3d& p) {
    const auto [height, gradient] = waves(p);
    return std::pair{p.z() - height, Eigen::Vector3d(Eigen::Vector3d(0, 0, 1) - gradient)};
  };
}

Field textured_plane(std::uint64_t seed, double slope, double shortest_mm, double longest_mm) {
  return relief(random_waves(seed, slope, shortest_mm, longest_mm, true));
}

Field uneven_waffle(double period_mm) { return together(waffle(period_mm), textured_plane(5, 0.08)); }

Field bumpy_ellipsoid(std::uint64_t seed, const Eigen::Vector3d& semi_axes_mm, double slope, int waves) {
  return [waves = random_waves(seed, slope, 1.2, 3.5, false, waves), semi_axes_mm](const Eigen::Vector3d& p) {
    const Eigen::Vector3d q = p.cwiseQuotient(semi_axes_mm);
    const double scale = semi_axes_mm.minCoeff();
    const auto [bump, gradient] = waves(p);
    return std::pair{scale * (q.norm() - 1) + bump,
                     Eigen::Vector3d(scale * q.cwiseQuotient(semi_axes_mm) / q.norm() + gradient)};
  };
}

View everywhere() { return {.contact_width_px = 300, .contact_height_px = 300}; }

View small_view() { return {.contact_width_px = 60, .contact_height_px = 50}; }

Pose pressed(double radius_mm, double depth_mm) {
  Pose pose = Pose::Identity();
  pose.translation().z() = -radius_mm + depth_mm;
  return pose;
}

Pose motion(double rx_deg, double ry_deg, double rz_deg, double x_mm, double y_mm, double z_mm) {
  Pose pose = Pose::Identity();
  pose.linear() = so3_exp({0, 0, rz_deg * kDegree}) * so3_exp({rx_deg * kDegree, ry_deg * kDegree, 0});
  pose.translation() = Eigen::Vector3d(x_mm, y_mm, z_mm);
  return pose;
}

bool follow_ray(const Field& field, const Pose& object_T_sensor, double x, double y, double start_z,
                double& z, Eigen::Vector3d& normal, double distance_mm) {
  const Eigen::Vector3d foot(x, y, 0), along = distance_mm > 0
                                                   ? Eigen::Vector3d(x / distance_mm, y / distance_mm, 1)
                                                   : Eigen::Vector3d(0, 0, 1);
  const Eigen::Vector3d up = object_T_sensor.linear() * along;
  z = start_z;
  double last_step = 0, last_value = 0;
  for (int i = 0; i < 60; ++i) {
    const auto [value, gradient] = field(object_T_sensor * Eigen::Vector3d(foot + z * along));
    const double rise = gradient.dot(up);
    if (std::abs(rise) < 1e-3) return false;
    const double step = std::clamp(-value / rise, -0.5, 0.5);
    if (last_step > 0 && step < 0 && value * last_value > 0) return false;  // the ray has passed it
    z += step;
    last_step = step;
    last_value = value;
    if (std::abs(step) > 1e-6) continue;  // quadratic convergence: what is left is 1e-12
    normal = object_T_sensor.linear().transpose() * gradient.normalized();
    if (normal.z() < 0) normal = -normal;
    return true;
  }
  return false;
}

void set_curvature(Surface& surface, const cv::Mat1f& gx, const cv::Mat1f& gy) {
  cv::Mat1f along_x, along_y;
  cv::Sobel(gx, along_x, CV_32F, 1, 0, 1, 0.5);
  cv::Sobel(gy, along_y, CV_32F, 0, 1, 1, 0.5);
  cv::Mat1f curvature;
  cv::add(along_x, along_y, curvature);
  cv::GaussianBlur(curvature, curvature, {5, 5}, 0);
  curvature.setTo(0, surface.contact == 0);
  cv::min(curvature, 0.7, curvature);
  cv::max(curvature, -0.7, curvature);
  surface.curvature = curvature;
}

std::shared_ptr<Surface> touch(const Field& field, const Pose& object_T_sensor, const View& view) {
  auto surface = std::make_shared<Surface>();
  const cv::Size size(view.width_px, view.height_px);
  surface->pixel_pitch_mm = view.pixel_pitch_mm;
  surface->optics.camera_distance_mm = view.camera_distance_mm;
  surface->height_mm = cv::Mat1f::zeros(size);
  surface->normals = cv::Mat3f(size, cv::Vec3f(0, 0, 1));
  surface->contact = cv::Mat1b::zeros(size);
  cv::Mat1f gx(size, 0.0F), gy(size, 0.0F);
  for (int v = 0; v < size.height; ++v) {
    double start_z = -3;
    for (int u = 0; u < size.width; ++u) {
      const double du = u - size.width * 0.5 + 0.5, dv = v - size.height * 0.5 + 0.5;
      const double radius2 = std::pow((du - view.contact_center_px.x()) / view.contact_width_px, 2) +
                             std::pow((dv - view.contact_center_px.y()) / view.contact_height_px, 2);
      double z = 0;
      Eigen::Vector3d n;
      if (radius2 > 1.2 ||
          !follow_ray(field, object_T_sensor, du * view.pixel_pitch_mm, dv * view.pixel_pitch_mm, start_z, z,
                      n, view.camera_distance_mm) ||
          z > 0.1 || n.z() < 0.2) {
        start_z = -3;
        continue;
      }
      start_z = z - 0.02;
      gx(v, u) = static_cast<float>(-n.x() / n.z());
      gy(v, u) = static_cast<float>(-n.y() / n.z());
      surface->height_mm(v, u) = static_cast<float>(z);
      surface->normals(v, u) = cv::Vec3f(n.cast<float>().eval().data());
      if (radius2 <= 1 && z <= 0) surface->contact(v, u) = 255;
    }
  }
  set_curvature(*surface, gx, gy);
  surface->contact_pixels = cv::countNonZero(surface->contact);
  return surface;
}

double uniform(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
}

double normal_deviate(std::mt19937_64& random) {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) sum += static_cast<double>(random() >> 11) * 0x1p-53;
  return sum;
}

cv::Mat2f noise_field(const cv::Size& size, double correlation_px, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  cv::Mat2f noise(size);
  for (cv::Vec2f& pair : noise)
    for (float& value : pair.val) value = static_cast<float>(normal_deviate(random));
  if (correlation_px <= 0) return noise;
  cv::GaussianBlur(noise, noise, {}, 0.5 * correlation_px);
  noise *= std::sqrt(2.0 * static_cast<double>(noise.total())) / cv::norm(noise);
  return noise;
}

SurfacePtr with_noise(const Surface& clean, double sigma_rad, std::uint64_t seed, double correlation_px) {
  auto surface = std::make_shared<Surface>(clean);
  surface->normals = cv::Mat3f(clean.normals.size());
  const cv::Mat2f noise = noise_field(clean.normals.size(), correlation_px, seed);
  cv::Mat1f gx(clean.normals.size()), gy(clean.normals.size());
  for (int v = 0; v < gx.rows; ++v)
    for (int u = 0; u < gx.cols; ++u) {
      const cv::Vec3f before = clean.normals(v, u);
      const Eigen::Vector3d n(before[0], before[1], before[2]);
      const Eigen::Vector3d a = n.unitOrthogonal(), b = n.cross(a);
      const Eigen::Vector3d noisy = (n + sigma_rad * (noise(v, u)[0] * a + noise(v, u)[1] * b)).normalized();
      surface->normals(v, u) = cv::Vec3f(noisy.cast<float>().eval().data());
      gx(v, u) = static_cast<float>(-noisy.x() / noisy.z());
      gy(v, u) = static_cast<float>(-noisy.y() / noisy.z());
    }
  set_curvature(*surface, gx, gy);
  return surface;
}

PoseGap gap(const Pose& a, const Pose& b) {
  const Pose between = a.inverse() * b;
  return {rotation_angle_rad(between) / kDegree, between.translation().norm()};
}

void expect_within(const PoseGap& gap, double deg, double mm) {
  EXPECT_LT(gap.deg, deg);
  EXPECT_LT(gap.mm, mm);
}

}  // namespace gelslam::test
