#include "gelslam/backend/rig.hpp"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

#include "gelslam/backend/uncertain_motion.hpp"
#include "whitened_graph.hpp"

namespace gelslam {
namespace {

using namespace backend::detail;

constexpr int kFirstScale = 6, kSecondScale = kFirstScale + kScaleTerms;  // among the unknowns
using Derivative = Eigen::Matrix<double, 6, Eigen::Dynamic>;

constexpr double kLeverMm = kOverlapSigmaMm / 2;  // what a turn of a radian moves at a sensor's border

/// Relative to the first instant of both components: what the sensors have moved since.
struct MotionPair {
  Pose first = Pose::Identity(), second = Pose::Identity();
};

std::vector<MotionPair> motion_pairs(const std::vector<RigConstraint>& constraints,
                                     const PoseGraphSolution& solution) {
  std::map<std::pair<int, int>, MotionPair> start_of;  // by both components
  std::vector<MotionPair> pairs;
  for (const RigConstraint& constraint : constraints) {
    const auto first = solution.component_of_node.find(constraint.first_keyframe),
               second = solution.component_of_node.find(constraint.second_keyframe);
    if (first == solution.component_of_node.end() || second == solution.component_of_node.end()) continue;
    const MotionPair now{
        solution.component_T_node.at(constraint.first_keyframe) * constraint.first_keyframe_T_sensor,
        solution.component_T_node.at(constraint.second_keyframe) * constraint.second_keyframe_T_sensor};
    const auto [start, is_first] = start_of.try_emplace({first->second, second->second}, now);
    if (is_first) continue;
    pairs.push_back({start->second.first.inverse() * now.first, start->second.second.inverse() * now.second});
  }
  return pairs;
}

/// What lies between A X and X B.
struct HandEyeError {
  Eigen::Quaterniond a_rotation, b_rotation;
  Eigen::Vector3d a_mm, b_mm;

  template <typename T>
  bool operator()(const T* first_T_second, T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> rotation(first_T_second);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> mm(first_T_second + 4);
    const Eigen::Quaternion<T> ax = a_rotation.cast<T>() * rotation, xb = rotation * b_rotation.cast<T>();
    Eigen::Quaternion<T> error = ax.conjugate() * xb;
    if (error.w() < T(0)) error.coeffs() = -error.coeffs();
    Eigen::Map<Eigen::Matrix<T, 6, 1>> r(residual);
    r.template head<3>() = T(2 * kLeverMm) * error.vec();
    r.template tail<3>() = rotation * b_mm.cast<T>() + mm - a_rotation.cast<T>() * mm - a_mm.cast<T>();
    return true;
  }
};

struct Fit {
  NodeState first_T_second;
  double cost = std::numeric_limits<double>::infinity();
};

Fit fit_from(const Eigen::Quaterniond& start, const std::vector<MotionPair>& pairs) {
  Fit fit{{start.x(), start.y(), start.z(), start.w(), 0, 0, 0}};
  ceres::Problem problem;
  for (const MotionPair& pair : pairs)
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<HandEyeError, 6, 7>(new HandEyeError{
            Eigen::Quaterniond(pair.first.linear()), Eigen::Quaterniond(pair.second.linear()),
            pair.first.translation(), pair.second.translation()}),
        nullptr, fit.first_T_second.data());
  problem.SetManifold(
      fit.first_T_second.data(),
      new ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (summary.IsSolutionUsable()) fit.cost = summary.final_cost;
  return fit;
}

/// The rotations of a cube: no rotation is further than 63 degrees from one of them.
std::vector<Eigen::Quaterniond> cube_rotations() {
  std::vector<Eigen::Quaterniond> rotations;
  for (int x = 0; x < 3; ++x)
    for (int y = 0; y < 3; ++y)
      for (const int sign_x : {1, -1})
        for (const int sign_y : {1, -1}) {
          if (x == y) continue;
          Eigen::Matrix3d rotation = Eigen::Matrix3d::Zero();
          rotation(x, 0) = sign_x;
          rotation(y, 1) = sign_y;
          rotation.col(2) = rotation.col(0).cross(rotation.col(1));
          rotations.emplace_back(rotation);
        }
  return rotations;
}

/// With the pieces that constraints join laid side by side, each by the first of these edges that leads
/// there.
std::map<int, Pose> joined(const PoseGraphSolution& solution, const std::vector<PoseGraphEdge>& links) {
  std::map<int, Pose> poses = solution.component_T_node;
  std::map<int, int> piece = solution.component_of_node;
  for (const PoseGraphEdge& link : links) {
    const int from = piece.at(link.from), to = piece.at(link.to);
    if (from == to) continue;
    const Pose move = poses.at(link.from) * link.from_T_to * poses.at(link.to).inverse();
    for (auto& [node, of_node] : piece) {
      if (of_node != to) continue;
      poses.at(node) = normalized(move * poses.at(node));
      of_node = from;
    }
  }
  return poses;
}

}  // namespace

std::optional<Pose> rig_from_motions(const std::vector<RigConstraint>& constraints,
                                     const PoseGraphSolution& solution) {
  const std::vector<MotionPair> pairs = motion_pairs(constraints, solution);
  if (pairs.size() < 2) return std::nullopt;  // one motion leaves an axis open
  Fit best;
  for (const Eigen::Quaterniond& start : cube_rotations())
    if (const Fit fit = fit_from(start, pairs); fit.cost < best.cost) best = fit;
  if (!std::isfinite(best.cost)) return std::nullopt;
  return to_pose(best.first_T_second);
}

std::vector<PoseGraphEdge> rig_edges(const std::vector<RigConstraint>& constraints,
                                     const Pose& first_T_second) {
  const Matrix6d second_by_first = adjoint(first_T_second.inverse());
  std::vector<PoseGraphEdge> edges;
  for (const RigConstraint& constraint : constraints) {
    const Pose sensor_T_keyframe = constraint.second_keyframe_T_sensor.inverse();
    // Of the second sensor's place in the first one's keyframe, and in its own.
    const Matrix6d covariance = second_by_first * constraint.first_covariance * second_by_first.transpose() +
                                constraint.second_covariance;
    const Matrix6d by_keyframe = adjoint(sensor_T_keyframe);
    const Matrix6d information = by_keyframe.transpose() * covariance.inverse() * by_keyframe;
    edges.push_back({constraint.first_keyframe, constraint.second_keyframe,
                     constraint.first_keyframe_T_sensor * first_T_second * sensor_T_keyframe,
                     0.5 * (information + information.transpose()), EdgeKind::odometry});
  }
  return edges;
}

SharedUnknowns rig_unknowns(const std::vector<PoseGraphEdge>& edges,
                            const std::vector<RigConstraint>& constraints, const Pose& first_T_second,
                            const RigPrior& prior) {
  const bool with_scales = prior.scale_sigma > 0;
  const int unknowns = with_scales ? kSecondScale + kScaleTerms : kFirstScale;
  SharedUnknowns shared;
  for (const PoseGraphEdge& edge : edges) {
    const bool is_second = edge.from >= prior.first_of_second;
    const bool is_between = !is_second && edge.to >= prior.first_of_second;
    Derivative by_unknown = Derivative::Zero(6, with_scales && !is_between ? unknowns : 0);
    if (by_unknown.cols() > 0)
      by_unknown.middleCols<kScaleTerms>(is_second ? kSecondScale : kFirstScale) =
          motion_by_gradient_scale(edge);
    shared.edge_by_unknown.push_back(by_unknown);
  }
  for (const RigConstraint& constraint : constraints) {
    const Pose second_T_keyframe = constraint.second_keyframe_T_sensor.inverse();
    Derivative by_unknown(6, unknowns);
    by_unknown.leftCols<6>() = adjoint(constraint.second_keyframe_T_sensor);
    if (with_scales) {
      by_unknown.middleCols<kScaleTerms>(kFirstScale) =
          adjoint((first_T_second * second_T_keyframe).inverse()) *
          motion_by_gradient_scale({0, 1, constraint.first_keyframe_T_sensor});
      by_unknown.middleCols<kScaleTerms>(kSecondScale) =
          -adjoint(constraint.second_keyframe_T_sensor) *
          motion_by_gradient_scale({0, 1, constraint.second_keyframe_T_sensor});
    }
    shared.edge_by_unknown.push_back(by_unknown);
  }
  shared.mean = Eigen::VectorXd::Zero(unknowns);
  shared.information = Eigen::MatrixXd::Zero(unknowns, unknowns);
  constexpr double kAnywhereRad = std::numbers::pi, kAnywhereMm = 1000;
  shared.information.diagonal().head<3>().setConstant(1 / (kAnywhereRad * kAnywhereRad));
  shared.information.diagonal().segment<3>(3).setConstant(1 / (kAnywhereMm * kAnywhereMm));
  if (prior.known) {
    shared.information.topLeftCorner<6, 6>() = prior.known->covariance.inverse();
    shared.mean.head<6>() = se3_log(first_T_second.inverse() * prior.known->first_T_second);
  }
  if (with_scales)
    for (const int scale : {kFirstScale, kSecondScale})
      shared.information.diagonal().segment<kScaleTerms>(scale) =
          scale_sigmas(prior.scale_sigma).cwiseAbs2().cwiseInverse();
  return shared;
}

RigSolution solve_with_rig(const PoseGraphSolution& solution, const std::vector<PoseGraphEdge>& edges,
                           const std::vector<RigConstraint>& constraints, const Pose& first_T_second,
                           const RigPrior& prior, const PoseGraphOptions& options) {
  constexpr int kMaxRounds = 10;       // numerics
  constexpr double kSettledMm = 1e-3;  // numerics
  RigSolution rig{first_T_second, rig_edges(constraints, first_T_second), {}};
  std::map<int, Pose> poses = joined(solution, rig.edges);
  for (int round = 0; round < kMaxRounds; ++round) {
    std::vector<PoseGraphEdge> all = edges;
    all.insert(all.end(), rig.edges.begin(), rig.edges.end());
    rig.graph =
        solve_pose_graph(poses, all, options, rig_unknowns(edges, constraints, rig.first_T_second, prior));
    const Vector6d step = rig.graph.shared_unknowns;
    rig.first_T_second = normalized(rig.first_T_second * se3_exp(step));
    rig.edges = rig_edges(constraints, rig.first_T_second);
    rig.graph.shared_unknowns.setZero();
    poses = rig.graph.component_T_node;
    if (kLeverMm * step.head<3>().norm() + step.tail<3>().norm() < kSettledMm) break;
  }
  return rig;
}

}  // namespace gelslam
