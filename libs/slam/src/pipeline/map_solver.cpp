#include "pipeline/map_solver.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <iterator>
#include <utility>

#include "gelslam/backend/rig.hpp"
#include "gelslam/backend/uncertain_motion.hpp"
#include "gelslam/slam/refinement.hpp"
#include "gelslam/slam/trial_drift.hpp"

namespace gelslam::slam::detail {
namespace {

/// `edges` without what contradicts them, or the rig.
std::vector<PoseGraphEdge> consistent(const SlamMap& map, const std::vector<PoseGraphEdge>& edges,
                                      double scale_sigma) {
  return chosen(edges, consistent_edges(with_rig_edges(map, edges), scale_sigma));
}

/// Where it is known how two sensors are fixed to each other, it judges loops between them: two sides of an
/// object may look alike.
std::vector<PoseGraphEdge> before_the_rig(const SlamMap& map) {
  const SensorRig& rig = map.measured.rig;
  if (!rig.known || rig.constraints.empty()) return map.edges;
  std::vector<PoseGraphEdge> within;
  std::copy_if(map.edges.begin(), map.edges.end(), std::back_inserter(within),
               [&](const PoseGraphEdge& edge) {
                 return (edge.from < rig.first_of_second) == (edge.to < rig.first_of_second);
               });
  return within;
}

RigPrior prior_of_rig(const SlamMap& map, double scale_sigma) {
  const SensorRig& rig = map.measured.rig;
  return {rig.known ? &*rig.known : nullptr, rig.first_of_second, scale_sigma};
}

/// The unknowns that were solved with the poses: the rig's, or the gradient scale.
SharedUnknowns shared_unknowns(const SlamMap& map, double scale_sigma, const SlamOptions& options) {
  if (map.rig)
    return rig_unknowns(map.edges, map.measured.rig.constraints, map.rig->first_T_second,
                        prior_of_rig(map, scale_sigma));
  if (!options.gradient_scale.estimate) return {};
  return gradient_scale_unknowns(map.edges, scale_sigma);
}

/// Solves again, after the map's edges have changed; with a rig for the poses alone, for surfaces of several
/// sensors are corrected before.
void solve_again(SlamMap& map, double scale_sigma, const SlamOptions& options) {
  if (!map.rig) {
    map.solution = solve_poses(map.solution.component_T_node, map.edges, scale_sigma, options);
    return;
  }
  RigSolution rig = solve_with_rig(map.solution, map.edges, map.measured.rig.constraints,
                                   map.rig->first_T_second, prior_of_rig(map, 0), options.pose_graph);
  map.solution = std::move(rig.graph);
  map.rig->first_T_second = rig.first_T_second;
}

Matrix6d rig_covariance(const SlamMap& map, const SlamOptions& options) {
  const int gauge = map.measured.rig.constraints.front().first_keyframe;
  return graph_covariances(with_rig_edges(map, map.edges), map.solution, gauge, options.pose_graph,
                           shared_unknowns(map, 0, options))
      .shared_unknowns;
}

bool is_determined(const Matrix6d& covariance) {
  // On rods and threads, whose motions are hardly observable, sigmas are larger, and the rig is wrong by
  // more.
  constexpr double kMaxSigmaMm = 0.3, kMaxSigmaRad = 0.035;
  const Vector6d sigma = sigma_of(covariance);
  return sigma.head<3>().maxCoeff() < kMaxSigmaRad && sigma.tail<3>().maxCoeff() < kMaxSigmaMm;
}

/// Joins what two sensors have felt at the same time, if their motions tell how they are fixed to each other.
/// `measured`: all edges, of which loops between the sensors can be judged then.
void join_by_rig(SlamMap& map, const std::vector<PoseGraphEdge>& measured, double scale_sigma,
                 const SlamOptions& options) {
  const SensorRig& rig = map.measured.rig;
  if (rig.constraints.empty()) return;
  const std::optional<Pose> start =
      rig.known ? std::optional(rig.known->first_T_second) : rig_from_motions(rig.constraints, map.solution);
  if (!start) return;
  const PoseGraphSolution apart = map.solution;
  map.rig = RigPose{*start};
  solve_again(map, scale_sigma, options);
  if (!rig.known && !is_determined(rig_covariance(map, options))) {
    map.rig.reset();
    map.solution = apart;
    return;
  }
  map.edges = consistent(map, measured, scale_sigma);
  solve_again(map, scale_sigma, options);
}

/// Of the rig's pose, from that of all shared unknowns. Tilts and slides alone hardly tell the gradient
/// scales, whatever their residuals say: the scales count as if the edges told nothing of them.
Matrix6d covariance_of_rig(const Eigen::MatrixXd& unknowns, double scale_sigma) {
  const Eigen::Index scales = unknowns.cols() - 6;
  const Eigen::MatrixXd of_scales = unknowns.bottomRightCorner(scales, scales);
  const Eigen::MatrixXd by_scales = of_scales.ldlt().solve(unknowns.bottomLeftCorner(scales, 6)).transpose();
  Eigen::MatrixXd unexplained = -of_scales;
  unexplained.diagonal() += scale_sigmas(scale_sigma).cwiseAbs2().replicate(scales / kScaleTerms, 1);
  return unknowns.topLeftCorner<6, 6>() + by_scales * unexplained * by_scales.transpose();
}

}  // namespace

double gradient_scale_sigma(const std::vector<std::shared_ptr<const Keyframe>>& keyframes,
                            const GradientScaleOptions& options) {
  double model_sigma = 0;
  for (const auto& keyframe : keyframes)
    if (keyframe) model_sigma = std::max(model_sigma, keyframe->surface.model_sigma());
  return options.sigma * model_sigma;
}

std::vector<PoseGraphEdge> chosen(const std::vector<PoseGraphEdge>& edges, const std::vector<bool>& keep) {
  std::vector<PoseGraphEdge> kept;
  for (std::size_t i = 0; i < edges.size(); ++i)
    if (keep[i]) kept.push_back(edges[i]);
  return kept;
}

PoseGraphSolution solve_poses(const std::map<int, Pose>& initial, const std::vector<PoseGraphEdge>& edges,
                              double scale_sigma, const SlamOptions& options) {
  if (initial.empty()) return {};  // a scan that has touched nothing has no model's sigma, either
  return options.gradient_scale.estimate
             ? solve_with_gradient_scale(initial, edges, options.pose_graph, scale_sigma)
             : solve_pose_graph(initial, edges, options.pose_graph);
}

void solve_map(SlamMap& map, const std::map<int, Pose>& initial, double scale_sigma,
               const SlamOptions& options) {
  const std::vector<PoseGraphEdge> measured = map.edges;
  map.edges = consistent(map, before_the_rig(map), scale_sigma);
  map.solution = solve_poses(initial, map.edges, scale_sigma, options);
  join_by_rig(map, measured, scale_sigma, options);
}

void add_overlap_edges(SlamMap& map, double scale_sigma, const SlamOptions& options,
                       const std::function<bool()>& stop_requested, ParallelProgress& progress) {
  for (int round = 0; round < kOverlapRounds; ++round) {
    const std::vector<PoseGraphEdge> found =
        find_overlap_edges(map.keyframes, map.solution, map.edges, options, stop_requested, &progress);
    if (found.empty() || stop_requested()) return;
    map.edges.insert(map.edges.end(), found.begin(), found.end());
    map.edges = consistent(map, map.edges, scale_sigma);
    solve_again(map, scale_sigma, options);
  }
}

MapCovariances assess_map(const SlamMap& map, int anchor, double scale_sigma, const SlamOptions& options) {
  const double sigma = map.rig ? options.registration.gradient_scale_error : scale_sigma;
  GraphCovariances covariances = graph_covariances(with_rig_edges(map, map.edges), map.solution, anchor,
                                                   options.pose_graph, shared_unknowns(map, sigma, options));
  return {std::move(covariances.gauge_T_node),
          map.rig ? covariance_of_rig(covariances.shared_unknowns, sigma) : Matrix6d::Zero()};
}

std::vector<PoseGraphEdge> with_rig_edges(const SlamMap& map, std::vector<PoseGraphEdge> edges) {
  if (!map.rig) return edges;
  const std::vector<PoseGraphEdge> of_rig = rig_edges(map.measured.rig.constraints, map.rig->first_T_second);
  edges.insert(edges.end(), of_rig.begin(), of_rig.end());
  return edges;
}

std::vector<PoseGraphEdge> loops_of_rig(const std::vector<RigConstraint>& constraints, const RigPose& rig) {
  std::map<std::pair<int, int>, RigConstraint> of_pair;
  for (const RigConstraint& c : constraints)
    of_pair.emplace(std::pair(c.first_keyframe, c.second_keyframe), c);
  std::vector<PoseGraphEdge> loops;
  for (const auto& [pair, constraint] : of_pair) {
    PoseGraphEdge edge = rig_edges({constraint}, rig.first_T_second).front();
    const Matrix6d by_rig = adjoint(constraint.second_keyframe_T_sensor);
    const Matrix6d covariance = edge.information.inverse() + static_cast<double>(of_pair.size()) * by_rig *
                                                                 rig.covariance * by_rig.transpose();
    edge.information = symmetric(covariance.inverse());
    edge.kind = EdgeKind::loop;
    loops.push_back(edge);
  }
  return loops;
}

}  // namespace gelslam::slam::detail
