#include "gelslam/backend/uncertain_motion.hpp"

#include <Eigen/LU>

#include "edge_residual.hpp"

namespace gelslam {

using namespace backend::detail;

namespace {

/// Inverse information; what an edge says nothing about is known to a radian and to the sensor's width, as in
/// whitening_matrix().
Matrix6d covariance_of(const Matrix6d& information) {
  constexpr double kWeakestPerMm2 = 1.0 / (20.0 * 20.0);
  Matrix6d padded = information;
  padded.diagonal() += (Vector6d() << 1, 1, 1, kWeakestPerMm2, kWeakestPerMm2, kWeakestPerMm2).finished();
  return padded.inverse();
}

Eigen::Matrix<double, 6, 2> derivative_by_gain(const PoseGraphEdge& edge) {
  constexpr double kStep = 1e-4;
  const NodeState state = to_state(edge.from_T_to);
  const Motion<double> motion = motion_of(state.data());
  Eigen::Matrix<double, 6, 2> result;
  for (int axis = 0; axis < 2; ++axis) {
    GainState gain = {1.0, 1.0};
    gain[static_cast<std::size_t>(axis)] += kStep;
    const Motion<double> read = as_measured(motion, edge.shared_center_mm, gain.data());
    result.col(axis) = motion_error(motion.rotation, motion.translation_mm, read) / kStep;
  }
  return result;
}

}  // namespace

UncertainMotion uncertain_motion(const PoseGraphEdge& edge) {
  return {edge.from_T_to, covariance_of(edge.information), derivative_by_gain(edge)};
}

UncertainMotion compose(const UncertainMotion& a, const UncertainMotion& b) {
  const Matrix6d to_end = adjoint(b.from_T_to.inverse());
  return {a.from_T_to * b.from_T_to, to_end * a.covariance * to_end.transpose() + b.covariance,
          to_end * a.by_gain + b.by_gain};
}

}  // namespace gelslam
