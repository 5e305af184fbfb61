#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <random>
#include <utility>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam::test {

inline constexpr double kDegree = M_PI / 180.0;
inline constexpr double kPitchMm = 0.0634;  ///< of the pixels of a GelSight Mini

/// Zero set of a smooth function of a point in mm: its value and its gradient. Positive in the object or
/// negative, but always growing or always falling along the sensor's z until the first crossing.
using Field = std::function<std::pair<double, Eigen::Vector3d>(const Eigen::Vector3d&)>;

Field sphere(double radius_mm);

/// Infinite cylinder about the x axis.
Field cylinder(double radius_mm);

/// A profile without symmetry (two flanks and a rounded edge between them), the same at every x.
Field extruded_edge();

/// A flat face with raised strokes, as on a coin: most of it shows nothing.
Field coin_face();

/// The same bump again and again, in both directions.
Field waffle(double period_mm);

/// One texture upon another.
Field together(const Field& one, const Field& other);

Field plane();

/// Sum of waves in space, each a direction (1/mm), a phase and an amplitude (mm).
struct Waves {
  struct Wave {
    Eigen::Vector3d k;
    double phase, amplitude_mm;
  };
  std::vector<Wave> waves;

  std::pair<double, Eigen::Vector3d> operator()(const Eigen::Vector3d& p) const;
};

/// Waves with lengths between the two given ones in all directions (in the xy plane only when `flat`), root
/// mean square slope `slope`: no place looks like another.
Waves random_waves(std::uint64_t seed, double slope, double shortest_mm, double longest_mm, bool flat,
                   int count = 14);

/// A texture that has no end: z = sum of waves of x and y.
Field relief(const Waves& waves);

/// Of random waves.
Field textured_plane(std::uint64_t seed, double slope = 0.15, double shortest_mm = 1.0,
                     double longest_mm = 3.0);

/// Bumps that are not quite alike: one further NormalFlow settles, too, and its gates see nothing.
Field uneven_waffle(double period_mm);

Field bumpy_ellipsoid(std::uint64_t seed, const Eigen::Vector3d& semi_axes_mm = {9, 7, 6},
                      double slope = 0.12, int waves = 14);

/// The sensor and where it may see contact: inside an ellipse at the image center, and below the untouched
/// gel.
struct View {
  int width_px = 320, height_px = 240;
  double pixel_pitch_mm = kPitchMm;
  double camera_distance_mm = 0;                                ///< 0: orthographic
  double contact_width_px = 110, contact_height_px = 85;        ///< semi-axes
  Eigen::Vector2d contact_center_px = Eigen::Vector2d::Zero();  ///< from the image center
};

/// Contact wherever the sensor looks: where it ends within the picture, other touches would find the gel bare
/// that the object goes on over.
View everywhere();
/// A contact of 7.6 by 6.3 mm, which a short slide outgrows.
View small_view();

/// A body's lowest point lies in the sensor's middle, `depth_mm` below the untouched gel: pose body_T_sensor
/// for a body whose lowest point in its own frame is (0, 0, -radius).
Pose pressed(double radius_mm, double depth_mm);

/// Small motion: rotations about x, y, z in degrees (twist outermost), then translation in mm.
Pose motion(double rx_deg, double ry_deg, double rz_deg, double x_mm, double y_mm, double z_mm = 0);

/// First crossing of the sensor's ray that meets z = 0 at (x, y) with the field, for a camera `distance_mm`
/// behind that plane (0: parallel rays): z in the sensor's frame and the surface's
/// normal there (z up), by Newton's method with bounded steps from below; false where the ray misses.
bool follow_ray(const Field& field, const Pose& object_T_sensor, double x, double y, double start_z,
                double& z, Eigen::Vector3d& normal, double distance_mm = 0);

/// Curvature as the surface stage defines it: smoothed divergence of the slopes, per pixel.
void set_curvature(Surface& surface, const cv::Mat1f& gx, const cv::Mat1f& gy);

/// What a perfect sensor at object_T_sensor would tell of the object. The surface goes on a little beyond the
/// contact, as the gel does: maps are continuous at its border.
std::shared_ptr<Surface> touch(const Field& field, const Pose& object_T_sensor, const View& view = {});

/// Deviates that are the same on every platform; the normal one is the sum of twelve uniform ones.
double uniform(std::mt19937_64& random, double low, double high);
double normal_deviate(std::mt19937_64& random);

/// Two fields of standard normal noise: white, or correlated over about so many pixels.
cv::Mat2f noise_field(const cv::Size& size, double correlation_px, std::uint64_t seed);

/// The same surface with noise on its normals: `sigma_rad` about each of the two axes in the tangent plane.
SurfacePtr with_noise(const Surface& clean, double sigma_rad, std::uint64_t seed, double correlation_px = 0);

/// Rotation (degrees) and translation (mm) between two poses.
struct PoseGap {
  double deg, mm;
};
PoseGap gap(const Pose& a, const Pose& b);
void expect_within(const PoseGap& gap, double deg, double mm);

}  // namespace gelslam::test
