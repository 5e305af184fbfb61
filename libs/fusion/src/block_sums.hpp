#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "blocks.hpp"
#include "field.hpp"

namespace gelslam::fusion::detail {

/// Distance value of a voxel where nothing was observed.
constexpr float kUnobserved = std::numeric_limits<float>::quiet_NaN();

/// Position of a block's voxels.
struct BlockLattice {
  Eigen::Vector3i first_voxel;
  float voxel_size_mm;

  Eigen::Vector3f position(const Eigen::Vector3i& voxel) const { return voxel.cast<float>() * voxel_size_mm; }
};

/// Index of a voxel in a block; x varies fastest.
inline std::size_t voxel_index(const Eigen::Vector3i& local, int edge) {
  return static_cast<std::size_t>((local.z() * edge + local.y()) * edge + local.x());
}

/// Sums of the observations of all patches at a block's voxels, to which patches can be added and from which
/// they can be removed exactly. This requires that every observation belongs to one of two opposite sides.
/// Where it does not, as at an edge of the object (`valid` is false), the field must be evaluated voxel by
/// voxel.
class BlockSums {
 public:
  /// Computes the sums of the given patches.
  void gather(const BlockLattice& lattice, const PatchList& patches, const Field& field);
  void add(const BlockLattice& lattice, const Patch& patch, const Field& field) {
    change(lattice, patch, field, 1);
  }
  /// `patch` must be one that was gathered or added before.
  void take(const BlockLattice& lattice, const Patch& patch, const Field& field) {
    change(lattice, patch, field, -1);
  }

  bool valid() const { return valid_; }

  /// Writes the field's distances; NaN where nothing was observed.
  void write_distances(const Field& field, std::vector<float>& distances) const;

 private:
  struct Voxel {
    DistanceSum sum;
    /// Number of observations with at least the field's minimal weight (touched_weight()).
    std::int16_t heavy = 0;
  };

  void change(const BlockLattice& lattice, const Patch& patch, const Field& field, int sign);
  void choose_axis(const BlockLattice& lattice, const PatchList& patches, const Field& field);

  bool valid_ = false;
  /// Axis along which the touch directions of both sides lie.
  Eigen::Vector3f axis_ = Eigen::Vector3f::Zero();
  /// Voxels of the side along the axis and of the side against it; empty until observed.
  std::array<std::vector<Voxel>, 2> sides_;
};

/// Computes the field's distances at a block's voxels, NaN where nothing was observed: from the sums if
/// possible, else voxel by voxel. Afterwards `sums` contains the patches, or is not valid.
void sample_block(const BlockLattice& lattice, const PatchList& patches, const Field& field, BlockSums& sums,
                  std::vector<float>& distances);

}  // namespace gelslam::fusion::detail
