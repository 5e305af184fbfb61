#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace gelslam {

/// Points sorted into the cells of a grid, to find those near a position. Fast for radii of about a cell's
/// width.
class PointGrid {
 public:
  PointGrid(std::vector<Eigen::Vector3d> points, double cell_width)
      : points_(std::move(points)), cell_width_(cell_width) {
    by_cell_.reserve(points_.size());
    for (std::uint32_t i = 0; i < points_.size(); ++i) by_cell_.emplace_back(cell(points_[i]), i);
    std::sort(by_cell_.begin(), by_cell_.end());
  }

  /// Calls visit(index) for all points within `radius`, cell by cell, in their order within a cell.
  template <typename Visit>
  void visit(const Eigen::Vector3d& center, double radius, Visit&& visit) const {
    const Cell low = cell(center.array() - radius), high = cell(center.array() + radius);
    for (int x = low[0]; x <= high[0]; ++x)
      for (int y = low[1]; y <= high[1]; ++y) {
        const Cell last{x, y, high[2]};
        auto entry = std::lower_bound(by_cell_.begin(), by_cell_.end(), Entry{{x, y, low[2]}, 0});
        for (; entry != by_cell_.end() && entry->first <= last; ++entry)
          if ((points_[entry->second] - center).norm() <= radius) visit(entry->second);
      }
  }

 private:
  using Cell = std::array<int, 3>;
  using Entry = std::pair<Cell, std::uint32_t>;

  Cell cell(const Eigen::Vector3d& point) const {
    const Eigen::Vector3i at = (point / cell_width_).array().floor().cast<int>();
    return {at.x(), at.y(), at.z()};
  }

  std::vector<Eigen::Vector3d> points_;
  double cell_width_;
  std::vector<Entry> by_cell_;
};

}  // namespace gelslam
