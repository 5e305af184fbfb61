#include "ball_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

namespace gelslam::bench {
namespace {

constexpr int min_pixels = 100;
constexpr double shrink_px = 4.0;
constexpr double huber_mm = 0.01;
constexpr int max_iterations = 50;

double slope_at(const Surface& surface, int u, int v) {
  const cv::Vec3f normal = surface.normals(v, u);
  return std::hypot(normal[0], normal[1]) / normal[2];
}

std::optional<Circle> deepest_place(const Surface& surface) {
  std::vector<float> heights;
  for (int v = 0; v < surface.contact.rows; ++v) {
    for (int u = 0; u < surface.contact.cols; ++u) {
      if (surface.contact(v, u) != 0) heights.push_back(surface.height_mm(v, u));
    }
  }
  if (heights.size() < min_pixels) return std::nullopt;
  const auto tenth = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 10);
  std::nth_element(heights.begin(), tenth, heights.end());
  double sum_u = 0.0, sum_v = 0.0, count = 0.0;
  for (int v = 0; v < surface.contact.rows; ++v) {
    for (int u = 0; u < surface.contact.cols; ++u) {
      if (surface.contact(v, u) == 0 || surface.height_mm(v, u) > *tenth) continue;
      sum_u += u;
      sum_v += v;
      count += 1.0;
    }
  }
  return Circle{sum_u / count, sum_v / count, 0.0};
}

struct Sphere {  // lower half: z = center_z - sqrt(radius^2 - distance^2)
  double x = 0.0, y = 0.0, z = 0.0, radius = 0.0;
};

// One Gauss-Newton step with Huber weights; false when the points do not fit on the sphere at all.
bool improve(const std::vector<Eigen::Vector3d>& points, Sphere& sphere, double& step) {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (const Eigen::Vector3d& point : points) {
    const double dx = point.x() - sphere.x, dy = point.y() - sphere.y;
    const double under_root = sphere.radius * sphere.radius - dx * dx - dy * dy;
    if (under_root < 1e-4 * sphere.radius * sphere.radius) return false;
    const double root = std::sqrt(under_root);
    const double residual = sphere.z - root - point.z();
    const Eigen::Vector4d jacobian(-dx / root, -dy / root, 1.0, -sphere.radius / root);
    const double weight = std::min(1.0, huber_mm / std::max(std::abs(residual), 1e-12));
    information += weight * jacobian * jacobian.transpose();
    right -= weight * residual * jacobian;
  }
  const Eigen::Vector4d update = information.ldlt().solve(right);
  if (!update.allFinite()) return false;
  sphere.x += update[0];
  sphere.y += update[1];
  sphere.z += update[2];
  sphere.radius += update[3];
  step = update.norm();
  return true;
}

}  // namespace

std::optional<Circle> find_contact_circle(const Surface& surface) {
  std::optional<Circle> circle = deepest_place(surface);
  if (!circle) return std::nullopt;
  const int longest = std::max(surface.contact.rows, surface.contact.cols);
  std::vector<double> sums(static_cast<std::size_t>(longest) + 1, 0.0), counts(sums.size(), 0.0);
  for (int v = 0; v < surface.contact.rows; ++v) {
    for (int u = 0; u < surface.contact.cols; ++u) {
      const auto distance =
          static_cast<std::size_t>(std::lround(std::hypot(u - circle->u_px, v - circle->v_px)));
      if (distance >= sums.size()) continue;
      sums[distance] += slope_at(surface, u, v);
      counts[distance] += 1.0;
    }
  }
  double steepest = 0.0;
  for (std::size_t distance = 1; distance + 1 < sums.size(); ++distance) {
    const double count = counts[distance - 1] + counts[distance] + counts[distance + 1];
    if (count < 6.0 * static_cast<double>(distance))
      continue;  // less than a third of the ring is in the image
    const double slope = (sums[distance - 1] + sums[distance] + sums[distance + 1]) / count;
    if (slope <= steepest) continue;
    steepest = slope;
    circle->radius_px = static_cast<double>(distance);
  }
  return circle;
}

std::optional<double> fit_ball_radius_mm(const Surface& surface, const Circle& circle,
                                         double start_radius_mm) {
  const double reach_px = circle.radius_px - shrink_px;
  std::vector<Eigen::Vector3d> points;
  double lowest_mm = 0.0;
  for (int v = 0; v < surface.contact.rows; ++v) {
    for (int u = 0; u < surface.contact.cols; ++u) {
      if (std::hypot(u - circle.u_px, v - circle.v_px) > reach_px) continue;
      points.emplace_back(u * surface.pixel_pitch_mm, v * surface.pixel_pitch_mm, surface.height_mm(v, u));
      lowest_mm = std::min(lowest_mm, points.back().z());
    }
  }
  if (reach_px <= 0.0 || points.size() < min_pixels) return std::nullopt;
  Sphere sphere{circle.u_px * surface.pixel_pitch_mm, circle.v_px * surface.pixel_pitch_mm,
                lowest_mm + start_radius_mm, start_radius_mm};
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    double step = 0.0;
    if (!improve(points, sphere, step)) return std::nullopt;
    if (step < 1e-6) return sphere.radius;
  }
  return std::nullopt;
}

}  // namespace gelslam::bench
