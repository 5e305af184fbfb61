#include "gaussian_grid.hpp"

#include <cmath>

namespace gelslam::baselines::detail {
namespace {

constexpr int kRadius = 2;  // In cells; 2.4 standard deviations of the blur.
constexpr int kMargin = kRadius + 1;

std::array<float, 2 * kRadius + 1> blur_taps() {
  constexpr double variance = 1.0 - 2.0 / 6.0;  // In cells².
  std::array<float, 2 * kRadius + 1> taps{};
  double sum = 0;
  for (int i = -kRadius; i <= kRadius; ++i) sum += std::exp(-0.5 * i * i / variance);
  for (int i = -kRadius; i <= kRadius; ++i)
    taps[static_cast<std::size_t>(i + kRadius)] = static_cast<float>(std::exp(-0.5 * i * i / variance) / sum);
  return taps;
}

}  // namespace

GaussianGrid::GaussianGrid(const ContactPoints& points, double sigma_mm) : cell_mm_(sigma_mm) {
  Eigen::Vector3d low = points.position_mm.front(), high = low;
  for (const Eigen::Vector3d& p : points.position_mm) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  origin_mm_ = low.array() - kMargin * cell_mm_;
  std::size_t cells = kChannels;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    size_[axis] = static_cast<int>(std::ceil((high[a] - low[a]) / cell_mm_)) + 2 * kMargin + 1;
    cells *= static_cast<std::size_t>(size_[axis]);
  }
  cells_.assign(cells, 0.0F);
  splat(points);
  blur();
}

GaussianGrid::Corner GaussianGrid::corner(const Eigen::Vector3d& cells) const {
  const Eigen::Vector3d base = cells.array().floor();
  const Eigen::Vector3f up = (cells - base).cast<float>();
  const auto index = base.cast<std::size_t>().eval();
  const auto width = static_cast<std::size_t>(size_[0]), height = static_cast<std::size_t>(size_[1]);
  const std::size_t first = (index.z() * height + index.y()) * width + index.x();
  Corner corner;
  for (std::size_t k = 0; k < 8; ++k) {
    const std::size_t dx = k & 1, dy = (k >> 1) & 1, dz = k >> 2;
    corner.cell[k] = (first + (dz * height + dy) * width + dx) * kChannels;
    corner.share[k] = (dx ? up.x() : 1 - up.x()) * (dy ? up.y() : 1 - up.y()) * (dz ? up.z() : 1 - up.z());
  }
  return corner;
}

void GaussianGrid::splat(const ContactPoints& points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Corner c = corner(in_cells(points.position_mm[i]));
    const Eigen::Vector3f position = (points.position_mm[i] - origin_mm_).cast<float>();
    const Eigen::Vector3f normal = points.normal[i].cast<float>();
    for (std::size_t k = 0; k < 8; ++k) {
      float* cell = cells_.data() + c.cell[k];
      cell[0] += c.share[k];
      for (int axis = 0; axis < 3; ++axis) {
        cell[1 + axis] += c.share[k] * position[axis];
        cell[4 + axis] += c.share[k] * normal[axis];
      }
    }
  }
}

void GaussianGrid::blur() {
  const std::array taps = blur_taps();
  // Because of the margin, all neighbors of a relevant cell are inside the grid; cells at its ends wrap
  // around into zeros.
  const std::size_t strides[] = {
      kChannels, kChannels * static_cast<std::size_t>(size_[0]),
      kChannels * static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1])};
  std::vector<float> from(cells_.size());
  for (const std::size_t stride : strides) {
    from.swap(cells_);
    cells_.assign(from.size(), 0.0F);
    const std::size_t reach = kRadius * stride;
    if (from.size() <= 2 * reach) continue;
    float* out = cells_.data() + reach;
    const float* in = from.data();
    const std::size_t count = from.size() - 2 * reach;
    for (std::size_t i = 0; i < count; ++i)
      out[i] = taps[0] * in[i] + taps[1] * in[i + stride] + taps[2] * in[i + 2 * stride] +
               taps[3] * in[i + 3 * stride] + taps[4] * in[i + 4 * stride];
  }
}

GaussianGrid::Sums GaussianGrid::at(const Eigen::Vector3d& point_mm) const {
  Sums sums;
  const Eigen::Vector3d cells = in_cells(point_mm);
  if (!cells.allFinite()) return sums;
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    if (cells[axis] < 0 || cells[axis] >= size_[static_cast<std::size_t>(axis)] - 1) return sums;
  const Corner c = corner(cells);
  std::array<float, kChannels> sum{};
  for (std::size_t k = 0; k < 8; ++k)
    for (std::size_t channel = 0; channel < kChannels; ++channel)
      sum[channel] += c.share[k] * cells_[c.cell[k] + channel];
  if (!(sum[0] > 1e-6F)) return sums;
  // The blur sums to one, and the integral of exp() is this.
  static const double scale = std::pow(2.0 * M_PI, 1.5);
  sums.weight = scale * sum[0];
  sums.position_mm = origin_mm_ + (Eigen::Vector3f(sum[1], sum[2], sum[3]) / sum[0]).cast<double>();
  sums.normal = (Eigen::Vector3f(sum[4], sum[5], sum[6]) / sum[0]).cast<double>();
  return sums;
}

}  // namespace gelslam::baselines::detail
