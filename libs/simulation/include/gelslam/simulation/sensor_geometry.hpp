#pragma once

#include <Eigen/Core>

namespace gelslam {

/// The simulated sensor's pixel grid (GelSight Mini). Frame: x right, y down, z out of the gel toward the
/// object, origin at the image center on the undeformed gel; orthographic.
struct SensorGeometry {
  int width_px = 320;
  int height_px = 240;
  double pixel_pitch_mm = 0.0634;

  float x_mm(double u) const { return static_cast<float>((u - 0.5 * width_px + 0.5) * pixel_pitch_mm); }
  float y_mm(double v) const { return static_cast<float>((v - 0.5 * height_px + 0.5) * pixel_pitch_mm); }
  double half_width_mm() const { return 0.5 * width_px * pixel_pitch_mm; }
  double half_height_mm() const { return 0.5 * height_px * pixel_pitch_mm; }
};

}  // namespace gelslam
