#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "contact_points.hpp"

namespace gelslam::baselines::detail {

/// Sums of Gaussians over a cloud's points, evaluated anywhere in constant time: the points are splatted onto
/// a regular grid of one sigma, blurred along its axes once, and read by interpolation. Splatting and reading
/// widen a point by a sixth of a cell's square each, which the blur is narrowed by (Adams et al. 2010 do the
/// same on another lattice).
class GaussianGrid {
 public:
  /// `points` is not empty. The grid covers their box; beyond it there is nothing.
  GaussianGrid(const ContactPoints& points, double sigma_mm);

  struct Sums {
    double weight = 0;                                      ///< sum of exp(-d^2 / (2 sigma^2)); 0 far away
    Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  ///< weighted mean of the points near
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();       ///< and of their normals, not unit
  };
  Sums at(const Eigen::Vector3d& point_mm) const;

 private:
  static constexpr int kChannels = 8;  // weight, position, normal, unused: full vector registers

  struct Corner {
    std::array<std::size_t, 8> cell;
    std::array<float, 8> share;
  };
  /// The eight cells about a point inside the grid.
  Corner corner(const Eigen::Vector3d& cells) const;
  Eigen::Vector3d in_cells(const Eigen::Vector3d& point_mm) const {
    return (point_mm - origin_mm_) / cell_mm_;
  }
  void splat(const ContactPoints& points);
  void blur();

  double cell_mm_;
  Eigen::Vector3d origin_mm_;  // of the cell (0, 0, 0)
  std::array<int, 3> size_{};
  std::vector<float> cells_;  // [z][y][x][channel]; positions count from the origin
};

}  // namespace gelslam::baselines::detail
