#pragma once

namespace gelslam {

/// What is estimated of a SlopeCorrection.
struct SlopeCalibrationOptions {
  bool estimate_gradient_scale = true;  ///< from loops, while the scan goes on and at its end
  double gradient_scale_sigma = 0.1;    ///< before any loop: a slope is read 1 +- this times too steep
  bool enabled = true;                  ///< at the end of the scan: all terms, from all registrations
};

}  // namespace gelslam
