#pragma once

#include "../support/analytic_surface.hpp"
#include "gelslam/frontend/keyframe.hpp"

namespace gelslam::test {

/// Waves of 0.9 to 3 mm length in all directions, so that no two places look the same.
inline Waves waves_of_any_place(std::uint64_t seed, double slope = 0.15) {
  return random_waves(seed, slope, 0.9, 3.0, true, 30);
}
inline Field random_texture(std::uint64_t seed, double slope = 0.15) {
  return relief(waves_of_any_place(seed, slope));
}

/// The same bump every 1.5 mm, like a knurl or a woven cloth.
inline Field grid_texture() {
  const double k = 2 * M_PI / 1.5;
  return relief({{{k * Eigen::Vector3d::UnitX(), 0, 0.05}, {k * Eigen::Vector3d::UnitY(), 0, 0.05}}});
}

struct Contact {
  double width_px = 95, height_px = 70;  // semi-axes of an ellipse at the image center
};

/// Returns the surface that a sensor at map_T_sensor sees of a texture around the plane z = 0 of the map. The
/// object is larger than the contact, and the gel outside the contact has the heights of the object, too.
inline SurfacePtr feel(const Field& texture, const Pose& map_T_sensor, const Contact& contact = {}) {
  View view;
  view.contact_width_px = contact.width_px;
  view.contact_height_px = contact.height_px;
  const auto surface = touch(texture, map_T_sensor, view);
  const Eigen::RowVector3d up = map_T_sensor.linear().row(2);
  for (int v = 0; v < view.height_px; ++v)
    for (int u = 0; u < view.width_px; ++u) {
      if (surface->height_mm(v, u) != 0) continue;
      const Eigen::Vector3d at_rest = surface->point_mm({u, v});
      surface->height_mm(v, u) =
          static_cast<float>(-(map_T_sensor.translation().z() + up.dot(at_rest)) / up.z());
    }
  return surface;
}

/// Sensor pose over the map: position in mm, twist about z and tilts in degrees.
inline Pose place(double x_mm, double y_mm, double twist_deg = 0, double tilt_x_deg = 0,
                  double tilt_y_deg = 0) {
  return motion(tilt_x_deg, tilt_y_deg, twist_deg, x_mm, y_mm, 0.3);
}

inline Keyframe keyframe(int id, int trial, SurfacePtr surface) {
  Keyframe k{id, id, trial, surface, {}};
  k.reference = std::make_shared<const NormalFlowReference>(surface, NormalFlowOptions{});
  return k;
}

}  // namespace gelslam::test
