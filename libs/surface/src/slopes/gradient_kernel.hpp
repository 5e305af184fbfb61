#pragma once

#include "gelslam/surface/gradient_model.hpp"

namespace gelslam::surface::detail {

inline constexpr int gradient_tile_pixels = 256;
inline constexpr int gradient_features = 5;  // B, G, R (0..1), u/W, v/H

/// The 5-32-32-32-2 network's numbers as the kernel reads them, row-major [out][in].
struct GradientWeights {
  float weight1[32 * 5], weight2[32 * 32], weight3[32 * 32], weight4[2 * 32];
  float bias1[32], bias2[32], bias3[32], bias4[2];
};

/// Throws Error when the model is not 5-32-32-32-2.
GradientWeights pack_weights(const GradientModel& model);

/// Network and tangent for one tile of 256 pixels. `features` is planar [5][256]; gx, gy get 256 gradients
/// each (dimensionless, height over distance; |slope| limited to 1.5 rad). Every lane is computed by the same
/// operations in the same order, so that a pixel's result does not depend on its place in a tile.
void gradient_tile(const GradientWeights& weights, const float* features, float* gx, float* gy);

}  // namespace gelslam::surface::detail
