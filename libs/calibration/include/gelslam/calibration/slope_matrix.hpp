#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// A linear model of a gradient model's errors: read slopes (rows) as a function of true slopes (columns)
/// along x and y.
struct SlopeMatrix {
  Eigen::Matrix2d read_over_true = Eigen::Matrix2d::Identity();
  Eigen::Matrix2d sigma = Eigen::Matrix2d::Zero();
  std::size_t touches = 0;
  /// Says whether the matrix differs significantly from the identity (chi², 5 %).
  bool needs_correction() const;
};

/// Estimates the matrix from touches of a ball of known diameter (not in the paper). The normals of a sphere
/// are a linear function of the position, whatever its center. Read slopes are regressed on true slopes, so
/// that noise of the read slopes causes no bias. Throws Error when no touch looks like a ball.
SlopeMatrix slope_matrix_from_ball(const std::vector<SurfacePtr>& touches, double diameter_mm);

}  // namespace gelslam
