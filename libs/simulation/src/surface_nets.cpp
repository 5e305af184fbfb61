// Meshes the zero level of an implicit shape by surface nets (after Gibson 1998). Each cell with a change of
// sign has one vertex. It starts at the mean of the edge crossings and is moved onto the surface by up to
// three Newton steps along the gradient. Each edge with a change of sign joins the vertices of its four cells
// to two triangles. Blocks of cells that are far from the surface, according to the shape's Lipschitz
// constant, are skipped.

#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "gelslam/core/error.hpp"
#include "shape_makers.hpp"

namespace gelslam::simulation::detail {
namespace {

constexpr int kBlockCells = 8;
constexpr int kBlockCorners = kBlockCells + 1;
constexpr std::int64_t kMaxCellsPerAxis = 1 << 20;  // Three of them fit into one 64-bit key.

constexpr float kSameGradientMm =
    0.01F;  // Ridges have a radius of 0.2 mm, so a gradient turns by 3 degrees over this distance.

using Cell = Eigen::Matrix<std::int64_t, 3, 1>;

std::int64_t key(const Cell& cell) {
  return (cell.z() * kMaxCellsPerAxis + cell.y()) * kMaxCellsPerAxis + cell.x();
}

/// A grid of cells over one shape, with corners that are `spacing` apart.
class Net {
 public:
  Net(const ImplicitShape& shape, float spacing) : shape_(shape), spacing_(spacing) {
    const Eigen::AlignedBox3f box = shape.bounds_mm();
    origin_ = box.min().array() - 1.5F * spacing;
    const Eigen::Vector3f extent = (box.sizes().array() + 3.0F * spacing) / (spacing * kBlockCells);
    blocks_ = extent.array().ceil().cast<std::int64_t>();
    if ((blocks_.array() * kBlockCells >= kMaxCellsPerAxis).any())
      throw Error("mesh spacing too fine for an object of this size");
  }

  Mesh build() {
    Cell block;
    for (block.z() = 0; block.z() < blocks_.z(); ++block.z())
      for (block.y() = 0; block.y() < blocks_.y(); ++block.y())
        for (block.x() = 0; block.x() < blocks_.x(); ++block.x()) add_block(block * kBlockCells);
    connect();
    return std::move(mesh_);
  }

 private:
  struct CrossedCell {
    Cell cell;
    /// For each axis, whether the value changes its sign from the first corner on: +1 rising, -1 falling, 0
    /// neither.
    std::array<int, 3> crossing;
  };

  Eigen::Vector3f corner_point(const Cell& corner) const { return origin_ + spacing_ * corner.cast<float>(); }

  void add_block(const Cell& first) {
    const float half = 0.5F * kBlockCells * spacing_;
    const Eigen::Vector3f center = corner_point(first).array() + half;
    if (std::abs(shape_.value(center)) > shape_.lipschitz() * half * 1.7321F) return;
    for (int z = 0, n = 0; z < kBlockCorners; ++z)
      for (int y = 0; y < kBlockCorners; ++y)
        for (int x = 0; x < kBlockCorners; ++x, ++n)
          values_[static_cast<std::size_t>(n)] = shape_.value(corner_point(first + Cell(x, y, z)));
    for (int z = 0; z < kBlockCells; ++z)
      for (int y = 0; y < kBlockCells; ++y)
        for (int x = 0; x < kBlockCells; ++x) add_cell(first, x, y, z);
  }

  void add_cell(const Cell& first, int x, int y, int z) {
    constexpr std::array<int, 3> stride = {1, kBlockCorners, kBlockCorners * kBlockCorners};
    const int base = x + y * stride[1] + z * stride[2];
    std::array<float, 8> value{};
    int inside = 0;
    for (int k = 0; k < 8; ++k) {
      const int index = base + (k & 1) * stride[0] + ((k >> 1) & 1) * stride[1] + ((k >> 2) & 1) * stride[2];
      value[static_cast<std::size_t>(k)] = values_[static_cast<std::size_t>(index)];
      inside += value[static_cast<std::size_t>(k)] < 0 ? 1 : 0;
    }
    if (inside == 0 || inside == 8) return;
    const Cell cell = first + Cell(x, y, z);
    CrossedCell crossed{cell, {}};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool from = value[0] < 0, to = value[std::size_t{1} << axis] < 0;
      crossed.crossing[axis] = from == to ? 0 : (from ? 1 : -1);
    }
    vertex_of_cell_.emplace(key(cell), static_cast<int>(mesh_.vertices_mm.size()));
    crossed_.push_back(crossed);
    add_vertex(corner_point(cell) + spacing_ * mean_crossing(value));
  }

  /// Mean of the points where the twelve edges of a unit cell cross zero.
  static Eigen::Vector3f mean_crossing(const std::array<float, 8>& value) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    int count = 0;
    for (int a = 0; a < 8; ++a)
      for (int axis = 0; axis < 3; ++axis) {
        const int b = a | (1 << axis);
        if (b == a) continue;
        const float fa = value[static_cast<std::size_t>(a)], fb = value[static_cast<std::size_t>(b)];
        if ((fa < 0) == (fb < 0)) continue;
        Eigen::Vector3f point(static_cast<float>(a & 1), static_cast<float>((a >> 1) & 1),
                              static_cast<float>((a >> 2) & 1));
        point[axis] += fa / (fa - fb);
        sum += point;
        ++count;
      }
    return sum / static_cast<float>(count);
  }

  void add_vertex(Eigen::Vector3f point) {
    Eigen::Vector3f gradient = shape_.gradient(point);
    for (int k = 0; k < 3; ++k) {
      const float squared = gradient.squaredNorm();
      if (squared < 1e-6F) break;
      const Eigen::Vector3f step = shape_.value(point) / squared * gradient;
      // Near an edge of the object the mean of the crossings is the better position.
      if (step.norm() > spacing_) break;
      point -= step;
      if (step.norm() > kSameGradientMm) gradient = shape_.gradient(point);
    }
    mesh_.vertices_mm.push_back(point);
    mesh_.normals.push_back(shape_.gradient(point).normalized());
  }

  void connect() {
    for (const CrossedCell& crossed : crossed_)
      for (int axis = 0; axis < 3; ++axis) {
        const int sign = crossed.crossing[static_cast<std::size_t>(axis)];
        if (sign == 0) continue;
        const Cell b = Cell::Unit((axis + 1) % 3), c = Cell::Unit((axis + 2) % 3);
        std::array<int, 4> quad = {vertex(crossed.cell - b - c), vertex(crossed.cell - c),
                                   vertex(crossed.cell), vertex(crossed.cell - b)};
        if (sign < 0) std::swap(quad[1], quad[3]);
        mesh_.triangles.emplace_back(quad[0], quad[1], quad[2]);
        mesh_.triangles.emplace_back(quad[0], quad[2], quad[3]);
      }
  }

  int vertex(const Cell& cell) const {
    const auto found = vertex_of_cell_.find(key(cell));
    if (found == vertex_of_cell_.end()) throw Error("the object's surface reaches beyond its stated bounds");
    return found->second;
  }

  const ImplicitShape& shape_;
  float spacing_;
  Eigen::Vector3f origin_;
  Cell blocks_;
  std::array<float, kBlockCorners * kBlockCorners * kBlockCorners> values_{};
  std::unordered_map<std::int64_t, int> vertex_of_cell_;
  std::vector<CrossedCell> crossed_;
  Mesh mesh_;
};

}  // namespace

Mesh surface_nets(const ImplicitShape& shape, float spacing_mm) {
  if (!(spacing_mm > 1e-3F)) throw Error("mesh spacing must be more than 0.001 mm");
  return Net(shape, spacing_mm).build();
}

}  // namespace gelslam::simulation::detail
