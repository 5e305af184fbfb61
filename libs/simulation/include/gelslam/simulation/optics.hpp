#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string_view>

#include "gelslam/simulation/gel.hpp"

namespace gelslam {

/// Imperfections of the sensor.
struct OpticsOptions {
  double noise_gain = 1.0;  ///< factor on read and shot noise; 0: none
  /// specks that move with the gel; some are there from the start, some come with contact
  bool dirt = false;
  int late_grains = 30;  ///< with dirt: specks that come with contact, 0 .. 10000
  /// Distance of printed dots, a third as wide, 0.5 .. 10; 0: none. They move with the gel: ink half a
  /// millimeter deep is carried sideways by half a millimeter times the slope, away from what presses.
  double dot_spacing_mm = 0.0;
  std::uint64_t seed = 1;  ///< of this sensor: noise, dirt
};

/// What the picture's pixels show of the gel.
struct GelView {
  cv::Mat2f place_px;  ///< on the grid of the gel
  cv::Mat2f slope;     ///< the surface's own
};

/// Draws the gel as the camera below it sees it, through its lens: three near lights (red from the top, green
/// from the right, blue from below) on a matt membrane, stray light, vignetting, a slightly soft lens, photon
/// and read noise, 8 bit. Color depends on slope and pixel only: no cast shadows, no light spilling from one
/// place to another.
class Optics {
 public:
  /// Throws Error for options out of range and optics that no sensor has.
  Optics(const SensorGeometry& geometry, const OpticsOptions& options);

  /// The grid of the gel that is drawn: larger than the picture where the lens looks beyond it.
  const SensorGeometry& gel_grid() const { return gel_grid_; }
  GelView view(const GelShape& gel) const;
  /// Pixel, fractional, in which a point of the sensor frame (mm) appears.
  Eigen::Vector2d image_px(const Eigen::Vector3d& point_mm) const;

  /// Deterministic: depends on the constructor's arguments, the gel and `frame` (the number of the picture,
  /// for noise) only. `in_use`: specks that came with contact are drawn.
  cv::Mat3b render(const GelShape& gel, std::int64_t frame, bool in_use) const;

  /// Without contact and noise, not rounded; BGR in gray levels.
  cv::Mat3f background() const { return background_; }

 private:
  void trace_to_plane();
  /// Rays that are those of the grid need no tracing.
  bool is_orthographic() const;
  cv::Mat2f seen_px(const cv::Mat1f& height_mm) const;
  /// Values on the grid where the pixels look.
  cv::Mat taken(const cv::Mat& map, const cv::Mat2f& place_px) const;
  cv::Mat3f shade(const cv::Mat2f& slope) const;
  cv::Mat3f draw(const GelView& view) const;
  void print_dots(const GelView& view, cv::Mat3f& picture) const;

  SensorGeometry geometry_;
  OpticsOptions options_;
  SensorGeometry gel_grid_;
  cv::Mat2d plane_mm_;            ///< where the rays meet the plane z = 0
  cv::Mat3f light_direction_[3];  ///< unit vectors from the membrane to each light (R, G, B)
  cv::Mat3f brightness_;          ///< of the three lights at each place, at full incidence
  cv::Mat3f ambient_;             ///< BGR
  GelView rest_;
  cv::Mat3f rest_color_;  ///< of the gel at rest, without specks and dots
  cv::Mat3f background_;
  cv::Mat1f albedo_;           ///< on the gel: specks from the start
  cv::Mat2f late_dirt_slope_;  ///< on the gel: specks that come with contact are little hills
};

/// As a person draws it: round the ring where the gel leaves the ball. `ball`: on the grid of the gel.
struct ImageCircle {
  cv::Point2d center_px;
  double radius_px = 0;
};
ImageCircle seen_circle(const Optics& optics, const PressedBall& ball);

/// Model files (docs/file-formats.md) of the simulated sensor, with a GelSight Mini's optics and with none.
/// scripts/simulated_models.sh makes them: `gelslam calibrate train` on presses of `gelslam simulate
/// presses`.
std::string_view mini_model_file();
std::string_view flat_model_file();

}  // namespace gelslam
