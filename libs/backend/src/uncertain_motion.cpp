#include "gelslam/backend/uncertain_motion.hpp"

#include <Eigen/LU>

#include "gelslam/backend/gradient_scale.hpp"

namespace gelslam {

namespace {

/// Inverse information; what an edge says nothing about is known to a radian and to the sensor's width, as in
/// whitening_matrix().
Matrix6d covariance_of(const Matrix6d& information) {
  constexpr double kWeakestPerMm2 = 1.0 / (20.0 * 20.0);
  Matrix6d padded = information;
  padded.diagonal() += (Vector6d() << 1, 1, 1, kWeakestPerMm2, kWeakestPerMm2, kWeakestPerMm2).finished();
  return padded.inverse();
}

}  // namespace

UncertainMotion uncertain_motion(const PoseGraphEdge& edge) {
  return {edge.from_T_to, covariance_of(edge.information), motion_by_gradient_scale(edge)};
}

UncertainMotion compose(const UncertainMotion& a, const UncertainMotion& b) {
  const Matrix6d to_end = adjoint(b.from_T_to.inverse());
  return {a.from_T_to * b.from_T_to, to_end * a.covariance * to_end.transpose() + b.covariance,
          to_end * a.by_scale + b.by_scale};
}

}  // namespace gelslam
