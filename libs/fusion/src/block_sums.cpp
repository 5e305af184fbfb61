// Incremental sums of the distance field in one block. An observation belongs to one of two opposite sides if
// its direction is within 44 degrees of the block's axis. For such blocks the field is a quotient of two
// integer sums per voxel and side, to which patches can be added and from which they can be removed without
// rounding errors.

#include "block_sums.hpp"

namespace gelslam::fusion::detail {
namespace {

/// Two directions within 44 degrees of the same axis differ by less than 90 degrees, so that they belong to
/// the same side.
constexpr float kMinCosine = 0.72f;

template <typename Visit>
void for_each_voxel(const BlockLattice& lattice, int stride, Visit&& visit) {
  for (int z = 0; z < kBlockEdge; z += stride) {
    for (int y = 0; y < kBlockEdge; y += stride) {
      for (int x = 0; x < kBlockEdge; x += stride) {
        const Eigen::Vector3i local(x, y, z);
        visit(voxel_index(local, kBlockEdge), lattice.position(lattice.first_voxel + local));
      }
    }
  }
}

}  // namespace

void BlockSums::gather(const BlockLattice& lattice, const PatchList& patches, const Field& field) {
  for (auto& side : sides_) side.clear();
  choose_axis(lattice, patches, field);
  valid_ = !axis_.isZero() && patches.size() < kMaxSummedPatches;
  for (std::size_t i = 0; valid_ && i < patches.size(); ++i) change(lattice, patches[i], field, 1);
}

/// Sets the axis to the mean touch direction at a few voxels. Opposite directions are reversed before
/// averaging.
void BlockSums::choose_axis(const BlockLattice& lattice, const PatchList& patches, const Field& field) {
  constexpr int stride = 3;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (const Patch& patch : patches) {
    for_each_voxel(lattice, stride, [&](std::size_t, const Eigen::Vector3f& point) {
      Observation o;
      if (!patch.observe(point, field.truncation_mm(), o)) return;
      sum += o.direction.dot(sum) < 0 ? Eigen::Vector3f(-o.direction) : o.direction;
    });
  }
  const float length = sum.norm();
  axis_ = length > 0 ? Eigen::Vector3f(sum / length) : Eigen::Vector3f::Zero();
}

void BlockSums::change(const BlockLattice& lattice, const Patch& patch, const Field& field, int sign) {
  if (!valid_) return;
  const Eigen::Vector3f axis = patch.in_sensor(axis_);
  for_each_voxel(lattice, 1, [&](std::size_t i, const Eigen::Vector3f& point) {
    Patch::Reading reading;
    if (!patch.read(point, field.truncation_mm(), reading)) return;
    const float cosine = Patch::cosine(reading, axis);
    if (std::fabs(cosine) < kMinCosine) {
      valid_ = false;
      return;
    }
    std::vector<Voxel>& side = sides_[cosine > 0 ? 0 : 1];
    if (side.empty()) side.resize(kBlockVoxels);
    const DistanceSum term = field.term(reading.distance_mm, reading.weight);
    Voxel& voxel = side[i];
    voxel.sum.weight += sign * term.weight;
    voxel.sum.weighted_distance += sign * term.weighted_distance;
    if (reading.weight >= field.touched_weight()) voxel.heavy = static_cast<std::int16_t>(voxel.heavy + sign);
  });
}

void BlockSums::write_distances(const Field& field, std::vector<float>& distances) const {
  distances.assign(kBlockVoxels, kUnobserved);
  for (const auto& side : sides_) {
    for (std::size_t i = 0; i < side.size(); ++i) {
      if (side[i].heavy == 0 || side[i].sum.weight == 0) continue;
      const float mean_mm = field.mean_mm(side[i].sum);
      // The larger distance is the intersection of the half-spaces of both sides.
      if (!(distances[i] >= mean_mm)) distances[i] = mean_mm;
    }
  }
}

void sample_block(const BlockLattice& lattice, const PatchList& patches, const Field& field, BlockSums& sums,
                  std::vector<float>& distances) {
  sums.gather(lattice, patches, field);
  if (sums.valid()) return sums.write_distances(field, distances);
  distances.assign(kBlockVoxels, kUnobserved);
  std::vector<Observation> scratch;
  for_each_voxel(lattice, 1, [&](std::size_t i, const Eigen::Vector3f& point) {
    FieldValue value;
    if (field.evaluate(point, patches, scratch, value)) distances[i] = value.distance_mm;
  });
}

}  // namespace gelslam::fusion::detail
