#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "gelslam/core/se3.hpp"
#include "gelslam/core/sensor_optics.hpp"
#include "gelslam/simulation/shape.hpp"

namespace gelslam {

/// The simulated sensor (GelSight Mini) and the grid on which its gel is computed. Frame: x right, y down, z
/// out of the gel toward the object, origin at the image center on the undeformed gel. The grid's pixels
/// look along z; those of a camera without lens and distance are the same. Flat by default, so that truth can
/// be compared pixel by pixel; `gelslam simulate` has a Mini's optics.
struct SensorGeometry {
  int width_px = 320;
  int height_px = 240;
  double pixel_pitch_mm = 0.0634;
  SensorOptics optics = {};

  float x_mm(double u) const { return static_cast<float>((u - 0.5 * width_px + 0.5) * pixel_pitch_mm); }
  float y_mm(double v) const { return static_cast<float>((v - 0.5 * height_px + 0.5) * pixel_pitch_mm); }
  double half_width_mm() const { return 0.5 * width_px * pixel_pitch_mm; }
  double half_height_mm() const { return 0.5 * height_px * pixel_pitch_mm; }
  /// Height of the gel at rest.
  double rest_mm(double x, double y) const {
    return -optics.gel_dome_per_mm[0] * x * x - optics.gel_dome_per_mm[1] * y * y;
  }
  /// Its highest point in the grid.
  double highest_rest_mm() const {
    const auto [a, b] = optics.gel_dome_per_mm;
    return rest_mm(a < 0 ? half_width_mm() : 0, b < 0 ? half_height_mm() : 0);
  }
};

/// Of the gel, a membrane under tension on an elastic foundation (Pasternak's model): length over which the
/// membrane rim around a contact decays, sqrt(tension / foundation stiffness). It also limits how far the gel
/// follows into pits: a surface hollower than |height| / length^2 is bridged.
inline constexpr double kGelRelaxationMm = 0.35;
inline constexpr double kMaxIndentationMm = 3.0;  ///< deeper parts of the object are cut off here

struct GelShape {
  cv::Mat1f height_mm;  ///< HxW, at most that of the gel at rest; never above the object
  cv::Mat1b contact;    ///< 255 where gel and object touch
  cv::Mat2f slope;      ///< HxW, (dh/dx, dh/dy), dimensionless
};

GelShape gel_at_rest(const SensorGeometry& geometry);

/// Lowest surface of the object above each pixel: z in mm in the sensor frame, +infinity where the object is
/// higher than the gel at rest or absent. Parts below -kMaxIndentationMm are clamped to it.
cv::Mat1f object_underside(const Shape& shape, const Pose& sensor_T_object, const SensorGeometry& geometry);

/// Moves the object along the sensor's z until its deepest point over the view has the given depth below a
/// flat gel. Nothing when that is not possible.
std::optional<Pose> settle_object(const Shape& shape, Pose sensor_T_object, double indentation_mm,
                                  const SensorGeometry& geometry);

/// Deforms the gel, h below its rest: minimizes tension/2 |grad h|^2 + stiffness/2 h^2 subject to rest + h <=
/// underside (an obstacle problem; coarse-to-fine, projected SOR), free borders. Throws Error on a size that
/// does not fit.
GelShape press_gel(const cv::Mat1f& underside_mm, const SensorGeometry& geometry);

/// The underside and the deformed gel in one call, for a gel that reaches a millimeter beyond the view on
/// every side, as a real one does.
GelShape press_object(const Shape& shape, const Pose& sensor_T_object, const SensorGeometry& geometry);

/// A ball in the gel, and the circle inside which the gel lies on it, on the grid of the gel.
struct PressedBall {
  GelShape gel;
  cv::Point2d center_px;
  double radius_px = 0;       ///< 0: no contact
  double ring_height_mm = 0;  ///< of the circle's points, the highest
};

/// `x_mm`, `y_mm`: place of the ball's middle; `depth_mm`: how far its lowest point lies below the untouched
/// gel.
PressedBall press_ball(const SensorGeometry& geometry, double ball_radius_mm, double x_mm, double y_mm,
                       double depth_mm);

}  // namespace gelslam
