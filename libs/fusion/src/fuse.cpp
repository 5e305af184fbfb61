#include <cmath>

#include "blocks.hpp"
#include "dual_mesher.hpp"
#include "field.hpp"
#include "fusion_options.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/fusion/fusion.hpp"
#include "patch.hpp"
#include "pieces.hpp"

namespace gelslam {
void fusion::detail::check_options(const FusionOptions& o) {
  if (!(o.voxel_size_mm >= 0.01 && o.voxel_size_mm <= 10))
    throw Error("the voxel size has to be 0.01 to 10 mm");
  if (!(o.truncation_mm >= 2 * o.voxel_size_mm && o.truncation_mm <= 100)) {
    throw Error("the truncation has to be at least two voxels and at most 100 mm");
  }
  if (!(o.min_weight > 0) || !std::isfinite(o.min_weight))
    throw Error("the minimal weight has to be positive");
}

Mesh fuse(const std::vector<PosedSurface>& patches, const FusionOptions& options) {
  using namespace fusion::detail;
  check_options(options);
  const std::vector<Patch> prepared = prepare_patches(patches, options.gradient_scale, options.threads);
  const float voxel = static_cast<float>(options.voxel_size_mm);
  const float truncation = static_cast<float>(options.truncation_mm);
  const BlockGrid grid(prepared, block_reach(voxel, truncation), options.threads);
  const Field field(truncation, static_cast<float>(options.min_weight));
  const Mesh mesh = extract_zero_set(grid, field, voxel, options.threads);
  return without_small_pieces(mesh, options.min_piece_mm2);
}

}  // namespace gelslam
