#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string_view>

#include "gelslam/simulation/gel.hpp"

namespace gelslam {

/// Imperfections of the sensor.
struct OpticsOptions {
  double noise_gain = 1.0;  ///< Factor on read noise and shot noise; 0: none.
  /// Specks on the gel that move with it. Some are there from the start, some appear with the first contact.
  bool dirt = false;
  int late_grains = 30;  ///< With dirt: number of specks that appear with contact, 0 .. 10000.
  /// Distance of printed dots, which are a third as wide, 0.5 .. 10 mm; 0: none. The dots move with the gel:
  /// as the ink is half a millimeter deep, it moves sideways by half a millimeter times the slope, away from
  /// the object.
  double dot_spacing_mm = 0.0;
  std::uint64_t seed = 1;  ///< Determines noise and dirt.
};

/// The part of the gel that each image pixel shows.
struct GelView {
  cv::Mat2f place_px;  ///< Position on the grid of the gel.
  cv::Mat2f slope;     ///< Slope of the surface itself.
};

/// Renders the gel as the camera below it sees it, through its lens: three near lights (red from the top,
/// green from the right, blue from below) on a matt membrane, stray light, vignetting, a slightly soft lens,
/// photon and read noise, 8 bit. The color of a pixel depends only on its slope and position: cast shadows
/// and light scattered between places are not simulated.
class Optics {
 public:
  /// Throws Error for options out of range and for impossible optics.
  Optics(const SensorGeometry& geometry, const OpticsOptions& options);

  /// Returns the grid on which the gel is computed. It is larger than the image if the lens sees more.
  const SensorGeometry& gel_grid() const { return gel_grid_; }
  GelView view(const GelShape& gel) const;
  /// Returns the image position (fractional pixel) of a point in the sensor frame (mm).
  Eigen::Vector2d image_px(const Eigen::Vector3d& point_mm) const;

  /// Renders an image. The result depends only on the constructor's arguments, the gel and `frame` (the image
  /// number, for noise). With `in_use`, specks that appear with contact are drawn.
  cv::Mat3b render(const GelShape& gel, std::int64_t frame, bool in_use) const;

  /// Returns the image without contact and noise, not rounded; BGR in gray levels.
  cv::Mat3f background() const { return background_; }

 private:
  void trace_to_plane();
  /// True if the rays are those of the grid, so that they need not be traced.
  bool is_orthographic() const;
  cv::Mat2f seen_px(const cv::Mat1f& height_mm) const;
  /// Returns the values of a map at the positions that the pixels show.
  cv::Mat taken(const cv::Mat& map, const cv::Mat2f& place_px) const;
  cv::Mat3f shade(const cv::Mat2f& slope) const;
  cv::Mat3f draw(const GelView& view) const;
  void print_dots(const GelView& view, cv::Mat3f& picture) const;

  SensorGeometry geometry_;
  OpticsOptions options_;
  SensorGeometry gel_grid_;
  cv::Mat2d plane_mm_;            ///< Intersections of the rays with the plane z = 0.
  cv::Mat3f light_direction_[3];  ///< unit vectors from the membrane to each light (R, G, B)
  cv::Mat3f brightness_;  ///< Intensity of the three lights at each place for perpendicular incidence.
  cv::Mat3f ambient_;     ///< BGR
  GelView rest_;
  cv::Mat3f rest_color_;  ///< Color of the gel at rest, without specks and dots.
  cv::Mat3f background_;
  cv::Mat1f albedo_;  ///< Of the gel, with the specks that are there from the start.
  /// Slopes of the specks that appear with contact, which are small hills on the gel.
  cv::Mat2f late_dirt_slope_;
};

/// The contact circle as people draw it: around the ring where the gel leaves the ball. `ball` is on the grid
/// of the gel.
struct ImageCircle {
  cv::Point2d center_px;
  double radius_px = 0;
};
ImageCircle seen_circle(const Optics& optics, const PressedBall& ball);

/// Return model files (docs/file-formats.md) of the simulated sensor, with the optics of a GelSight Mini and
/// without optics. scripts/simulated_models.sh makes them by `gelslam calibrate train` from presses of
/// `gelslam simulate presses`.
std::string_view mini_model_file();
std::string_view flat_model_file();

}  // namespace gelslam
