#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// What a model reads of slopes along x and y (columns) as slopes along x and y (rows).
struct SlopeMatrix {
  Eigen::Matrix2d read_over_true = Eigen::Matrix2d::Identity();
  Eigen::Matrix2d sigma = Eigen::Matrix2d::Zero();
  std::size_t touches = 0;
  /// It differs from the identity by more than such standard deviations explain (chi², 5 %).
  bool needs_correction() const;
};

/// From touches of a ball of known diameter (own): its normals are linear in the place, whatever its center.
/// Read slopes are regressed on true ones, so that noise of what is read has no effect. Throws Error when no
/// touch is that of a ball.
SlopeMatrix slope_matrix_from_ball(const std::vector<SurfacePtr>& touches, double diameter_mm);

}  // namespace gelslam
