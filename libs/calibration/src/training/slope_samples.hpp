#pragma once

#include <array>
#include <vector>

#include "gelslam/calibration/model_trainer.hpp"

namespace gelslam::calibration::detail {

/// One pixel whose slope is known.
struct SlopeSample {
  std::array<float, 3> color{}, flat_color{};  ///< BGR/255 of the press and of the background there
  std::array<float, 2> place{};                ///< u/W, v/H
  std::array<float, 2> angle_rad{};            ///< of dh/dx, dh/dy
  int u_px = 0, v_px = 0, zone = -1;           ///< zone -1: untouched gel
};

/// Slope angles of a ball of `ball_px` pixels radius at (u, v): atan2(u - center, depth of the surface).
std::array<float, 2> ball_angles_rad(double du_px, double dv_px, double ball_px);

/// Pixels inside the zones, on a grid just fine enough for about `wanted` in all, zones in turn.
std::vector<SlopeSample> zone_samples(const PressSet& set, const std::vector<BallZone>& zones,
                                      double pixel_pitch_mm, int wanted);

/// Pixels of the background, slope 0, evenly spread.
std::vector<SlopeSample> flat_samples(const PressSet& set, int wanted);

}  // namespace gelslam::calibration::detail
