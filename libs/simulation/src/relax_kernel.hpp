#pragma once

namespace gelslam::simulation::detail {

/// One row of one color of a projected red-black relaxation of tension * laplace(h) = stiffness * h, h <=
/// obstacle: self[i] <- min(obstacle[i], self[i] + omega * (weight * (up[i] + down[i] + side[i] + side[i +
/// 1]) - self[i])). The arrays do not overlap. `side` is the other color's row, shifted so that side[i] and
/// side[i + 1] are the left and right neighbors.
void relax_row(float* self, const float* up, const float* down, const float* side, const float* obstacle,
               int count, float weight, float omega);

}  // namespace gelslam::simulation::detail
