// Plain floats, no Eigen: compiled for several instruction sets, chosen at run time.

#include "relax_kernel.hpp"

#include "gelslam/core/target_clones.hpp"

namespace gelslam::simulation::detail {

GELSLAM_TARGET_CLONES("avx512f", "avx2", "default")
void relax_row(float* __restrict self, const float* __restrict up, const float* __restrict down,
               const float* __restrict side, const float* __restrict obstacle, int count, float weight,
               float omega) {
  for (int i = 0; i < count; ++i) {
    const float mean = weight * (up[i] + down[i] + side[i] + side[i + 1]);
    const float moved = self[i] + omega * (mean - self[i]);
    self[i] = moved < obstacle[i] ? moved : obstacle[i];
  }
}

}  // namespace gelslam::simulation::detail
