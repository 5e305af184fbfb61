#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "contact_points.hpp"

namespace gelslam::baselines::detail {

/// Sums of Gaussians over a cloud's points, which can be evaluated anywhere in constant time. The points are
/// splatted onto a regular grid with a cell width of one sigma, the grid is blurred along its axes once, and
/// it is read by interpolation. Splatting and reading widen the variance of a point by a sixth of a squared
/// cell each, by which the blur is narrowed (Adams et al. 2010 do the same on another lattice).
class GaussianGrid {
 public:
  /// `points` must not be empty. The grid covers their bounding box; outside it the sums are 0.
  GaussianGrid(const ContactPoints& points, double sigma_mm);

  struct Sums {
    double weight = 0;                                      ///< Sum of exp(-d² / (2 sigma²)); 0 far away.
    Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  ///< Weighted mean of the nearby points.
    /// Weighted mean of their normals; not a unit vector.
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  };
  Sums at(const Eigen::Vector3d& point_mm) const;

 private:
  // Weight, position, normal and one unused channel, so that vector registers are full.
  static constexpr int kChannels = 8;

  struct Corner {
    std::array<std::size_t, 8> cell;
    std::array<float, 8> share;
  };
  /// Returns the eight cells around a point inside the grid.
  Corner corner(const Eigen::Vector3d& cells) const;
  Eigen::Vector3d in_cells(const Eigen::Vector3d& point_mm) const {
    return (point_mm - origin_mm_) / cell_mm_;
  }
  void splat(const ContactPoints& points);
  void blur();

  double cell_mm_;
  Eigen::Vector3d origin_mm_;  // Position of the cell (0, 0, 0).
  std::array<int, 3> size_{};
  std::vector<float> cells_;  // Indexed by [z][y][x][channel]; positions are relative to the origin.
};

}  // namespace gelslam::baselines::detail
