#include "whitened_graph.hpp"

#include <Eigen/Cholesky>

#include "gelslam/core/error.hpp"
#include "gelslam/core/se3.hpp"

namespace gelslam::backend::detail {
namespace {

// Tolerance relative to the largest entry. It covers the rounding errors in a matrix that was computed as JᵀJ
// or transported by an adjoint.
constexpr double kRoundingTolerance = 1e-6;

}  // namespace

Matrix6d with_overlap_prior(const Matrix6d& information) {
  Matrix6d known = information;
  known.diagonal().head<3>().array() += 1.0 / (kOverlapSigmaRad * kOverlapSigmaRad);
  known.diagonal().tail<3>().array() += 1.0 / (kOverlapSigmaMm * kOverlapSigmaMm);
  return known;
}

Matrix6d whitening_matrix(const Matrix6d& information) {
  if (!information.allFinite())
    throw Error("pose graph: an edge's information contains a number that is not finite");
  const double largest = information.cwiseAbs().maxCoeff();
  if ((information - information.transpose()).cwiseAbs().maxCoeff() > kRoundingTolerance * largest)
    throw Error("pose graph: an edge's information is not symmetric");

  const Eigen::LLT<Matrix6d> factor(with_overlap_prior(symmetric(information)));
  if (factor.info() != Eigen::Success)
    throw Error("pose graph: an edge's information is not positive semi-definite");
  return factor.matrixU();
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
  if (unknowns.size() == 0) return error.norm();
  return (error - edge.by_unknown * unknowns).norm();
}

}  // namespace gelslam::backend::detail
