#include "whitened_graph.hpp"

#include "gelslam/core/error.hpp"
#include "gelslam/core/se3.hpp"

namespace gelslam::backend::detail {
namespace {

constexpr double kWeakestSigmaMm =
    20.0;  // overlapping frames are never further apart than the sensor is wide

// Relative to the largest entry: what rounding leaves in a matrix that was built as J'J or transported by an
// adjoint.
constexpr double kRoundingTolerance = 1e-6;

}  // namespace

Matrix6d whitening_matrix(const Matrix6d& information) {
  if (!information.allFinite())
    throw Error("pose graph: an edge's information contains a number that is not finite");
  const double largest = information.cwiseAbs().maxCoeff();
  if ((information - information.transpose()).cwiseAbs().maxCoeff() > kRoundingTolerance * largest)
    throw Error("pose graph: an edge's information is not symmetric");

  Vector6d weakest_sigma;
  weakest_sigma << 1.0, 1.0, 1.0, kWeakestSigmaMm, kWeakestSigmaMm, kWeakestSigmaMm;
  const Matrix6d symmetric = 0.5 * (information + information.transpose());
  const Matrix6d scaled = weakest_sigma.asDiagonal() * symmetric * weakest_sigma.asDiagonal();
  const SymmetricEigen eigen = symmetric_eigen(scaled);
  if (eigen.values.minCoeff() < -kRoundingTolerance * scaled.cwiseAbs().maxCoeff())
    throw Error("pose graph: an edge's information is not positive semi-definite");
  const Vector6d root = eigen.values.cwiseMax(1.0).cwiseSqrt();
  return root.asDiagonal() * eigen.vectors.transpose() * weakest_sigma.cwiseInverse().asDiagonal();
}

NodeState to_state(const Pose& pose) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(pose.linear()).normalized();
  const Eigen::Vector3d t = pose.translation();
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
}

Pose to_pose(const NodeState& state) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond(state.data()).normalized().toRotationMatrix();
  pose.translation() = Eigen::Map<const Eigen::Vector3d>(state.data() + 4);
  return pose;
}

double residual_norm(const WhitenedEdge& edge, const NodeState& from, const NodeState& to,
                     const Eigen::VectorXd& unknowns) {
  const Vector6d error = whitened_error(edge, from.data(), to.data());
  if (unknowns.size() == 0 || edge.by_unknown.cols() == 0) return error.norm();
  return (error - edge.by_unknown * unknowns).norm();
}

}  // namespace gelslam::backend::detail
