#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "gelslam/core/se3.hpp"
#include "gelslam/core/sensor_optics.hpp"
#include "gelslam/simulation/shape.hpp"

namespace gelslam {

/// The simulated sensor (GelSight Mini) and the grid on which its gel is computed. Frame: x right, y down, z
/// out of the gel toward the object, origin at the image center on the undeformed gel. The pixels of the grid
/// look along z, as do those of an orthographic camera without lens. By default the gel is flat and the
/// camera orthographic, so that ground truth can be compared pixel by pixel; `gelslam simulate` uses the
/// optics of a GelSight Mini.
struct SensorGeometry {
  int width_px = 320;
  int height_px = 240;
  double pixel_pitch_mm = 0.0634;
  SensorOptics optics = {};

  float x_mm(double u) const { return static_cast<float>((u - 0.5 * width_px + 0.5) * pixel_pitch_mm); }
  float y_mm(double v) const { return static_cast<float>((v - 0.5 * height_px + 0.5) * pixel_pitch_mm); }
  double half_width_mm() const { return 0.5 * width_px * pixel_pitch_mm; }
  double half_height_mm() const { return 0.5 * height_px * pixel_pitch_mm; }
  /// Returns the height of the gel at rest at (x, y) in mm.
  double rest_mm(double x, double y) const {
    return -optics.gel_dome_per_mm[0] * x * x - optics.gel_dome_per_mm[1] * y * y;
  }
  /// Returns the height of the highest point of the gel at rest within the grid.
  double highest_rest_mm() const {
    const auto [a, b] = optics.gel_dome_per_mm;
    return rest_mm(a < 0 ? half_width_mm() : 0, b < 0 ? half_height_mm() : 0);
  }
};

/// Parameter of the gel, which is modeled as a membrane under tension on an elastic foundation (Pasternak's
/// model): the length over which the membrane rim around a contact decays, sqrt(tension / foundation
/// stiffness). It also limits how far the gel follows into pits: where the object's surface is more concave
/// than |height| / length^2, the gel bridges it.
inline constexpr double kGelRelaxationMm = 0.35;
inline constexpr double kMaxIndentationMm = 3.0;  ///< deeper parts of the object are cut off here

struct GelShape {
  cv::Mat1f height_mm;  ///< HxW, at most that of the gel at rest, and never above the object.
  cv::Mat1b contact;    ///< 255 where gel and object touch
  cv::Mat2f slope;      ///< HxW, (dh/dx, dh/dy), dimensionless
};

GelShape gel_at_rest(const SensorGeometry& geometry);

/// Returns the height of the object's lowest surface above each pixel: z in mm in the sensor frame, +infinity
/// where the object is higher than the gel at rest or absent. Parts below -kMaxIndentationMm are clamped to
/// it.
cv::Mat1f object_underside(const Shape& shape, const Pose& sensor_T_object, const SensorGeometry& geometry);

/// Moves the object along the sensor's z axis until its deepest point within the view is `indentation_mm`
/// below a flat gel. Returns nothing if that is not possible.
std::optional<Pose> settle_object(const Shape& shape, Pose sensor_T_object, double indentation_mm,
                                  const SensorGeometry& geometry);

/// Computes the deformed gel: with h the displacement from the gel at rest, minimizes tension/2 |grad h|^2 +
/// stiffness/2 h^2 subject to rest + h <= underside, with free borders (an obstacle problem, solved by
/// projected SOR from coarse to fine). Throws Error if the size of `underside_mm` does not match.
GelShape press_gel(const cv::Mat1f& underside_mm, const SensorGeometry& geometry);

/// Computes underside and deformed gel together, for a gel that extends a millimeter beyond the view on every
/// side, as a real one does.
GelShape press_object(const Shape& shape, const Pose& sensor_T_object, const SensorGeometry& geometry);

/// A ball in the gel, with the circle inside which it touches the gel, on the grid of the gel.
struct PressedBall {
  GelShape gel;
  cv::Point2d center_px;
  double radius_px = 0;       ///< 0: no contact
  double ring_height_mm = 0;  ///< Height of the highest point of the circle.
};

/// Presses a ball with its center at (`x_mm`, `y_mm`) until its lowest point is `depth_mm` below the
/// untouched gel.
PressedBall press_ball(const SensorGeometry& geometry, double ball_radius_mm, double x_mm, double y_mm,
                       double depth_mm);

}  // namespace gelslam
