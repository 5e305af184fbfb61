#include "pipeline/slope_calibration.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "gelslam/core/index.hpp"
#include "gelslam/core/parallel.hpp"
#include "gelslam/core/progress.hpp"
#include "gelslam/registration/slope_sensitivity.hpp"

namespace gelslam::slam::detail {
namespace {

using PerTerm = SlopeSensitivity::PerTerm;
using TermMatrix = SlopeSensitivity::TermMatrix;
using Keyframes = std::vector<std::shared_ptr<const Keyframe>>;

constexpr int kRounds = 3;

Keyframes corrected(const Keyframes& read, const SlopeCorrection& correction,
                    const NormalFlowOptions& options, int threads) {
  if (correction.factors == SlopeCorrection{}.factors) return read;
  constexpr std::size_t kPerCorrector = 16;
  Keyframes result(read.size());
  parallel_for_ranges(read.size(), kPerCorrector, threads, [&](std::size_t begin, std::size_t end) {
    SlopeCorrector corrector;
    for (std::size_t id = begin; id < end; ++id) {
      if (!read[id]) continue;
      auto keyframe = std::make_shared<Keyframe>(*read[id]);
      keyframe->surface =
          StoredSurface(PackedSurface(*corrector.apply(*read[id]->surface.get(), correction)));
      keyframe->reference = StoredReference(keyframe->surface, options);
      result[id] = std::move(keyframe);
    }
  });
  return result;
}

/// What the residuals between normals tell about a change of the factors, as normal equations.
struct Residuals {
  TermMatrix information = TermMatrix::Zero();
  PerTerm pull = PerTerm::Zero();

  void add(const SlopeSensitivity& sensitivity, const RegistrationResult& result,
           const NormalFlowOptions& options) {
    // The residuals within a pair have few common causes: so many of its normals count as one.
    constexpr double kCommonError = 15.0;
    const double noise = std::max(options.normal_noise_rad, result.normal_rmse_rad);
    const double variance = noise * noise * kCommonError;
    information += sensitivity.hessian / variance;
    pull += sensitivity.pull / variance;
  }

  void add(const Residuals& other) {
    information += other.information;
    pull += other.pull;
  }

  /// Flatter surfaces always fit each other better, whatever the gradient scale: noise and the gel's
  /// smoothing shrink what two frames share. Scales, and biases that bend a patch as a whole, are therefore
  /// determined by loops alone: their information is removed here. That on small slopes is kept: where it
  /// matters, residuals ask for steeper ones.
  void marginalize_flattening() {
    constexpr int kAxis = static_cast<int>(SlopeCorrection::kTermsPerAxis);
    const std::array<int, 8> open = {0,     1,         kAxis - 2,     kAxis - 1,
                                     kAxis, kAxis + 1, 2 * kAxis - 2, 2 * kAxis - 1};
    Eigen::Matrix<double, 8, 8> among = information(open, open);
    among.diagonal().array() += 1e-6;  // singular without any residual
    const Eigen::Matrix<double, 8, SlopeSensitivity::kTerms> by_all =
        among.ldlt().solve(information(open, Eigen::all));
    pull -= by_all.transpose() * pull(open);
    information -= information(Eigen::all, open) * by_all;
    information(open, Eigen::all).setZero();
    information(Eigen::all, open).setZero();
    pull(open).setZero();
  }
};

double worst_model_sigma(const Keyframes& keyframes) {
  double model_sigma = 0;
  for (const auto& keyframe : keyframes)
    if (keyframe) model_sigma = std::max(model_sigma, keyframe->surface.model_sigma());
  return model_sigma;
}

/// Prior standard deviations of the factors.
PerTerm prior_sigma(const Keyframes& keyframes, double gradient_scale_sigma) {
  const auto sigma = SlopeCorrection::prior_sigma(gradient_scale_sigma, worst_model_sigma(keyframes));
  return Eigen::Map<const PerTerm>(sigma.data());
}

/// Residuals and prior together, of the change from these factors.
void set_knowledge(const Residuals& residuals, const SlopeCorrection& correction, const PerTerm& sigma,
                   SharedUnknowns& shared) {
  const PerTerm prior = sigma.cwiseAbs2().cwiseInverse();
  shared.information = residuals.information;
  shared.information.diagonal() += prior;
  const PerTerm factors = Eigen::Map<const PerTerm>(correction.factors.data());
  shared.mean = shared.information.ldlt().solve(residuals.pull - prior.cwiseProduct(factors));
}

struct Registered {
  RegistrationResult result;
  SlopeSensitivity sensitivity;  // where the result is ok
};

Registered registered_again(const CalibratedMap& map, std::size_t i, const NormalFlowOptions& options) {
  const PoseGraphEdge& edge = map.edges[i];
  Registered again;
  if (map.solution.edge_outlier[i]) return again;
  const Keyframe &from = *map.keyframes[index(edge.from)], &to = *map.keyframes[index(edge.to)];
  const Pose start =
      map.solution.component_T_node.at(edge.from).inverse() * map.solution.component_T_node.at(edge.to);
  again.result = register_normal_flow(*to.reference.get(), *from.surface.get(), start, options);
  if (again.result.ok())
    // At the pose that all edges agree on, for the same reason as in solve_with_gradient_scale().
    again.sensitivity = slope_sensitivity(*to.reference.get(), *from.surface.get(), start, options);
  return again;
}

void set_measurement(const RegistrationResult& result, PoseGraphEdge& edge) {
  edge.from_T_to = result.target_T_reference;
  edge.information = result.information;
  edge.shared_center_mm = result.shared_center_mm;
}

constexpr std::size_t kFolds = 2;

/// What the edges tell about the factors. Edges are dealt out to folds in turn.
struct Evidence {
  std::vector<Eigen::Matrix<double, 6, Eigen::Dynamic>> edge_by_factor;
  std::array<Residuals, kFolds> residuals;
};

/// Registers the map's edges again and returns how they depend on the factors. An edge that cannot be
/// registered stays as it was.
Evidence register_again(CalibratedMap& map, const NormalFlowOptions& options, int threads,
                        ParallelProgress& progress) {
  constexpr std::size_t kAtOnce = 256;  // 6 kB each
  Evidence evidence;
  evidence.edge_by_factor.resize(map.edges.size(), Eigen::Matrix<double, 6, Eigen::Dynamic>(6, 0));
  std::vector<Registered> registered;
  for (std::size_t first = 0; first < map.edges.size(); first += kAtOnce) {
    registered.assign(std::min(kAtOnce, map.edges.size() - first), {});
    parallel_for(registered.size(), threads, [&](std::size_t k) {
      registered[k] = registered_again(map, first + k, options);
      progress.step();
    });
    for (std::size_t k = 0; k < registered.size(); ++k) {
      const auto& [result, sensitivity] = registered[k];
      if (!result.ok()) continue;
      set_measurement(result, map.edges[first + k]);
      evidence.edge_by_factor[first + k] = sensitivity.pose_by_factor;
      evidence.residuals[(first + k) % kFolds].add(sensitivity, result, options);
    }
  }
  return evidence;
}

/// What the folds tell, without one of them (kFolds: with all), and the prior.
SharedUnknowns knowledge(const Evidence& evidence, std::size_t left_out, const SlopeCorrection& correction,
                         const PerTerm& sigma) {
  Residuals residuals;
  for (std::size_t fold = 0; fold < kFolds; ++fold)
    if (fold != left_out) residuals.add(evidence.residuals[fold]);
  residuals.marginalize_flattening();
  SharedUnknowns shared;
  shared.edge_by_unknown = evidence.edge_by_factor;
  set_knowledge(residuals, correction, sigma, shared);
  return shared;
}

/// Twice the negative logarithm of the likelihood of what a fold measured, given what the others say.
struct Prediction {
  double with_factors = 0, without = 0;
};

double cost_of(const std::vector<double>& residuals, const std::vector<std::size_t>& edges, double scale) {
  double cost = 0;
  for (const std::size_t i : edges) cost += robust_cost(residuals[i], scale);
  return cost;
}

/// Loops of one fold are left out, and so are the residuals of its normals. What is left predicts them.
Prediction predict(const CalibratedMap& map, const Evidence& evidence, std::size_t fold, const PerTerm& sigma,
                   const PoseGraphOptions& pose_graph) {
  constexpr double kLeftOut = 1e-6;  // of an edge's information, so that its residual is told
  std::vector<PoseGraphEdge> edges = map.edges;
  std::vector<std::size_t> left_out;
  for (std::size_t i = fold; i < edges.size(); i += kFolds)
    if (edges[i].kind == EdgeKind::loop && !map.solution.edge_outlier[i] &&
        evidence.edge_by_factor[i].cols() > 0) {
      edges[i].information *= kLeftOut;
      left_out.push_back(i);
    }
  const auto residuals = [&](const SharedUnknowns& shared, Eigen::VectorXd& factors) {
    PoseGraphSolution solution = solve_pose_graph(map.solution.component_T_node, edges, pose_graph, shared);
    factors = solution.shared_unknowns;
    for (double& residual : solution.edge_residual) residual /= std::sqrt(kLeftOut);
    return solution.edge_residual;
  };
  Eigen::VectorXd factors, none;
  const std::vector<double> with = residuals(knowledge(evidence, fold, map.correction, sigma), factors);
  const std::vector<double> without = residuals({}, none);
  Residuals normals = evidence.residuals[fold];
  normals.marginalize_flattening();
  return {cost_of(with, left_out, pose_graph.loop_loss_scale) + factors.dot(normals.information * factors) -
              2 * normals.pull.dot(factors),
          cost_of(without, left_out, pose_graph.loop_loss_scale)};
}

/// Whether the correction explains measurements that it was not fitted to. Registrations share errors that
/// their information does not contain, so that a small share of what is left unexplained proves nothing.
bool is_demanded(const CalibratedMap& map, const Evidence& evidence, const PerTerm& sigma,
                 const PoseGraphOptions& pose_graph) {
  constexpr double kExplained = 1.0 / 3.0;  // of what is unexplained without it
  constexpr double kTwoSigma = 4.0;         // as a difference of twice the log-likelihood
  double with_factors = 0, without = 0;
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    const Prediction prediction = predict(map, evidence, fold, sigma, pose_graph);
    with_factors += prediction.with_factors;
    without += prediction.without;
  }
  return without - with_factors > std::max(kTwoSigma, kExplained * without);
}

/// How far a correction is from none, in standard deviations of the prior.
double size_of(const SlopeCorrection& correction, const PerTerm& sigma) {
  return Eigen::Map<const PerTerm>(correction.factors.data()).cwiseQuotient(sigma).norm();
}

/// From a keyframe to the next one.
struct Link {
  Vector6d motion = Vector6d::Zero();      ///< as measured
  Vector6d correction = Vector6d::Zero();  ///< measured * exp(correction) is what corrected surfaces say
};

Link link_of(const Pose& measured, const Pose& corrected) {
  return {se3_log(measured), se3_log(measured.inverse() * corrected)};
}

/// Inner product of motions.
double dot(const Vector6d& a, const Vector6d& b) {
  return kMmPerRad * kMmPerRad * a.head<3>().dot(b.head<3>()) + a.tail<3>().dot(b.tail<3>());
}

/// The share of the link's motion that `motion` has made; smaller where it leads elsewhere.
double share_of(const Vector6d& motion, const Link& link) {
  constexpr double kMinMotion2 = 0.1 * 0.1;  // below 0.1 mm the direction is noise
  const double along = dot(motion, link.motion), link2 = dot(link.motion, link.motion),
               motion2 = dot(motion, motion);
  if (link2 < kMinMotion2 || motion2 < kMinMotion2) return 0.0;
  const double alike = along * along / (link2 * motion2);
  return std::clamp(alike * along / link2, 0.0, 1.0);
}

std::optional<CalibratedMap> calibrated_in_rounds(const SlamMap& read, const PoseGraphOptions& pose_graph,
                                                  const SlopeCalibrationOptions& options,
                                                  const NormalFlowOptions& normal_flow,
                                                  const std::function<bool()>& stop_requested, int threads,
                                                  ParallelProgress& progress) {
  constexpr double kSettledSigmas = 0.1;         // smaller steps change no pose by a noticeable amount
  constexpr double kRemainingScaleError = 0.02;  // of a gradient scale, once slopes were corrected
  const PerTerm sigma = prior_sigma(read.keyframes, options.gradient_scale_sigma);
  NormalFlowOptions registration = normal_flow;
  registration.gradient_scale_error = kRemainingScaleError;
  CalibratedMap map{read.slope_correction, {}, read.edges, read.solution};
  for (int round = 0; round < kRounds; ++round) {
    if (stop_requested()) return std::nullopt;
    map.keyframes = corrected(read.keyframes, map.correction, registration, threads);
    const Evidence evidence = register_again(map, registration, threads, progress);
    if (round == 0 && !is_demanded(map, evidence, sigma, pose_graph)) return std::nullopt;
    const SharedUnknowns shared = knowledge(evidence, kFolds, map.correction, sigma);
    map.solution = solve_pose_graph(map.solution.component_T_node, map.edges, pose_graph, shared);
    SlopeCorrection step;
    for (int k = 0; k < SlopeSensitivity::kTerms; ++k) {
      step.factors[index(k)] = map.solution.shared_unknowns[k];
      map.correction.factors[index(k)] += step.factors[index(k)];
    }
    if (!std::isfinite(size_of(map.correction, sigma))) return std::nullopt;
    if (size_of(step, sigma) < kSettledSigmas) break;
  }
  map.keyframes = corrected(read.keyframes, map.correction, registration, threads);
  return map;
}

}  // namespace

double gradient_scale_sigma(const Keyframes& keyframes, const SlopeCalibrationOptions& options) {
  return options.gradient_scale_sigma * worst_model_sigma(keyframes);
}

std::optional<CalibratedMap> calibrate_slopes(const SlamMap& read, const PoseGraphOptions& pose_graph,
                                              const SlopeCalibrationOptions& options,
                                              const NormalFlowOptions& normal_flow,
                                              const std::function<bool()>& stop_requested,
                                              ProgressSink* progress, int threads) {
  ParallelProgress calibrating(progress, "calibrating slopes", kRounds * read.edges.size());
  std::optional<CalibratedMap> map =
      calibrated_in_rounds(read, pose_graph, options, normal_flow, stop_requested, threads, calibrating);
  calibrating.end();
  return map;
}

void distribute_corrections(const std::vector<PoseGraphEdge>& measured,
                            const std::vector<PoseGraphEdge>& corrected, std::vector<FrameRecord>& frames) {
  std::map<std::pair<int, int>, const PoseGraphEdge*> links;
  for (const PoseGraphEdge& edge : corrected)
    if (edge.kind == EdgeKind::odometry) links[{edge.from, edge.to}] = &edge;
  std::map<int, std::vector<Link>> onward;  // to the next keyframe, and to turning points
  for (const PoseGraphEdge& edge : measured) {
    const auto link = links.find({edge.from, edge.to});
    if (edge.kind == EdgeKind::odometry && link != links.end())
      onward[edge.from].push_back(link_of(edge.from_T_to, link->second->from_T_to));
  }
  for (FrameRecord& frame : frames) {
    const auto links = onward.find(frame.keyframe);
    if (links == onward.end()) continue;
    const Vector6d motion = se3_log(frame.keyframe_T_frame);
    double share = 0;
    Vector6d correction = Vector6d::Zero();
    for (const Link& link : links->second)
      if (const double of_this = share_of(motion, link); of_this > share) {
        share = of_this;
        correction = link.correction;
      }
    frame.keyframe_T_frame = frame.keyframe_T_frame * se3_exp(share * correction);
  }
}

}  // namespace gelslam::slam::detail
