#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <random>

#include "../support/analytic_surface.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/frontend/keyframe.hpp"

namespace gelslam {

constexpr double kDegree = M_PI / 180.0;
constexpr double kPitchMm = 0.0634;

/// A surface z = f(x, y) in mm that has no end, with its slopes.
struct Texture {
  struct Wave {
    double kx, ky, phase, amplitude_mm;
  };
  std::vector<Wave> waves;

  Eigen::Vector3d height_and_slopes(double x, double y) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Wave& w : waves) {
      const double angle = w.kx * x + w.ky * y + w.phase;
      sum += Eigen::Vector3d(w.amplitude_mm * std::cos(angle), -w.amplitude_mm * w.kx * std::sin(angle),
                             -w.amplitude_mm * w.ky * std::sin(angle));
    }
    return sum;
  }
};

/// Waves of 0.9 to 3 mm in all directions, root mean square slope `slope`: no place looks like another.
inline Texture random_texture(std::uint64_t seed, double slope = 0.15) {
  constexpr int kWaves = 30;
  std::mt19937_64 random(seed);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  Texture texture;
  for (int i = 0; i < kWaves; ++i) {
    const double k = 2 * M_PI / (0.9 + 2.1 * uniform()), direction = 2 * M_PI * uniform();
    texture.waves.push_back({k * std::cos(direction), k * std::sin(direction), 2 * M_PI * uniform(),
                             slope * std::sqrt(2.0 / kWaves) / k});
  }
  return texture;
}

/// The same bump every 1.5 mm: a knurl, a woven cloth.
inline Texture grid_texture() {
  const double k = 2 * M_PI / 1.5;
  return {{{k, 0, 0, 0.05}, {0, k, 0, 0.05}}};
}

struct Contact {
  double width_px = 95, height_px = 70;  // semi-axes of an ellipse at the image center
};

/// What a sensor at map_T_sensor sees of the texture, which goes on beyond the contact (z up in the map; the
/// sensor looks along its -z at it, from inside the gel, so heights are read in the sensor's own frame),
/// noise-free, as a perfect surface estimator would tell it.
inline SurfacePtr touch(const Texture& texture, const Pose& map_T_sensor, const Contact& contact = {}) {
  constexpr int kWidth = 320, kHeight = 240;
  auto surface = std::make_shared<Surface>();
  surface->pixel_pitch_mm = kPitchMm;
  surface->height_mm = cv::Mat1f::zeros(kHeight, kWidth);
  surface->normals = cv::Mat3f(kHeight, kWidth, cv::Vec3f(0, 0, 1));
  surface->contact = cv::Mat1b::zeros(kHeight, kWidth);
  cv::Mat1f gx(kHeight, kWidth, 0.0F), gy(kHeight, kWidth, 0.0F);
  const Eigen::Matrix3d sensor_R_map = map_T_sensor.linear().transpose();
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const double dx = u - kWidth / 2.0 + 0.5, dy = v - kHeight / 2.0 + 0.5;
      Eigen::Vector3d p(dx * kPitchMm, dy * kPitchMm, 0), f;
      const double radius2 = std::pow(dx / contact.width_px, 2) + std::pow(dy / contact.height_px, 2);
      if (radius2 >
          1.3) {  // a little more than the contact, for derivatives at its border; then what is felt there
        const Eigen::RowVector3d up = map_T_sensor.linear().row(2);
        surface->height_mm(v, u) =
            static_cast<float>(-(map_T_sensor.translation().z() + up.x() * p.x() + up.y() * p.y()) / up.z());
        continue;
      }
      for (double gap = 1; std::abs(gap) > 1e-7;) {  // follow the ray along the sensor's z to the texture
        const Eigen::Vector3d q = map_T_sensor * p;
        f = texture.height_and_slopes(q.x(), q.y());
        gap = f[0] - q.z();
        p.z() += gap;
      }
      const Eigen::Vector3d n = sensor_R_map * Eigen::Vector3d(-f[1], -f[2], 1).normalized();
      gx(v, u) = static_cast<float>(-n.x() / n.z());
      gy(v, u) = static_cast<float>(-n.y() / n.z());
      surface->height_mm(v, u) = static_cast<float>(p.z());
      if (radius2 > 1) continue;
      surface->contact(v, u) = 255;
      surface->normals(v, u) =
          cv::Vec3f(static_cast<float>(n.x()), static_cast<float>(n.y()), static_cast<float>(n.z()));
    }
  test::set_curvature(*surface, gx, gy);
  surface->contact_pixels = cv::countNonZero(surface->contact);
  return surface;
}

/// Sensor pose over the map: position in mm, twist about z and tilts in degrees.
inline Pose place(double x_mm, double y_mm, double twist_deg = 0, double tilt_x_deg = 0,
                  double tilt_y_deg = 0) {
  Pose pose = Pose::Identity();
  pose.linear() =
      so3_exp({0, 0, twist_deg * kDegree}) * so3_exp({tilt_x_deg * kDegree, tilt_y_deg * kDegree, 0});
  pose.translation() = Eigen::Vector3d(x_mm, y_mm, 0.3);
  return pose;
}

inline Keyframe keyframe(int id, int trial, SurfacePtr surface) {
  Keyframe k{id, id, trial, surface, {}};
  k.reference = std::make_shared<const NormalFlowReference>(surface, NormalFlowOptions{});
  return k;
}

}  // namespace gelslam
