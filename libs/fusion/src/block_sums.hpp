#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "blocks.hpp"
#include "field.hpp"

namespace gelslam::fusion::detail {

/// The distance of a voxel where nothing was observed.
constexpr float kUnobserved = std::numeric_limits<float>::quiet_NaN();

/// Says where the voxels of one block are.
struct BlockLattice {
  Eigen::Vector3i first_voxel;
  float voxel_size_mm;

  Eigen::Vector3f position(const Eigen::Vector3i& voxel) const { return voxel.cast<float>() * voxel_size_mm; }
};

/// A block's voxels x fastest; what a voxel holds where nothing was observed is not a number.
inline std::size_t voxel_index(const Eigen::Vector3i& local, int edge) {
  return static_cast<std::size_t>((local.z() * edge + local.y()) * edge + local.x());
}

/// What the patches say at a block's voxels, as sums to which patches can be added and from which they can be
/// taken, exactly. That needs every observation to belong to one of two opposite sides whatever is added;
/// where an edge shows more than that (`valid` is false) the field has to be asked voxel by voxel.
class BlockSums {
 public:
  /// Starts again with these patches.
  void gather(const BlockLattice& lattice, const PatchList& patches, const Field& field);
  void add(const BlockLattice& lattice, const Patch& patch, const Field& field) {
    change(lattice, patch, field, 1);
  }
  /// `patch` must be one that was gathered or added.
  void take(const BlockLattice& lattice, const Patch& patch, const Field& field) {
    change(lattice, patch, field, -1);
  }

  bool valid() const { return valid_; }

  /// The field's distances, NaN where unobserved.
  void write_distances(const Field& field, std::vector<float>& distances) const;

 private:
  struct Voxel {
    DistanceSum sum;
    std::int16_t heavy = 0;  ///< observations of at least the field's minimal weight
  };

  void change(const BlockLattice& lattice, const Patch& patch, const Field& field, int sign);
  void choose_axis(const BlockLattice& lattice, const PatchList& patches, const Field& field);

  bool valid_ = false;
  Eigen::Vector3f axis_ = Eigen::Vector3f::Zero();  ///< one side's touch directions lie around it
  std::array<std::vector<Voxel>, 2> sides_;         ///< along the axis, against it; empty until seen
};

/// The field's distances at a block's voxels by whichever way works, NaN where unobserved. `sums` is left
/// holding the patches, or not valid.
void sample_block(const BlockLattice& lattice, const PatchList& patches, const Field& field, BlockSums& sums,
                  std::vector<float>& distances);

}  // namespace gelslam::fusion::detail
