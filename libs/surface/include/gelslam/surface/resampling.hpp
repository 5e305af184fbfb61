#pragma once

#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// The surface as a sensor of another pixel pitch would read it, over the same extent (whole pixels; the
/// center stays): so that surfaces of different sensors can be compared pixel by pixel. The same surface for
/// the same pitch.
SurfacePtr resampled(const Surface& surface, double pixel_pitch_mm);

}  // namespace gelslam
