// Solves an SE(3) pose graph with unknowns that all edges share, with Ceres on one thread.
//
// The cost, over the poses x and the shared unknowns u, is half of: the sum of |r|² over odometry edges, plus
// the sum of the robust cost of |r| over loops (loop_layers.cpp), plus the squared norm of the whitened prior
// of u. The residual of an edge is r = W (e - B u). Here e = log(measured⁻¹ x_from⁻¹ x_to) to first order;
// WᵀW is the edge's information plus the weak prior that overlapping frames differ by about kOverlapSigmaRad
// and kOverlapSigmaMm; and B is the derivative of the measured motion with respect to the unknowns (for the
// gradient scale, see uncertain_motion.cpp). The smallest node of each connected component is held fixed.
//
// If a loop remains an outlier, the graph is solved again, starting from a wide kernel that is narrowed step
// by step, and the solution with the smaller cost is kept. The initial poses must be roughly right along
// odometry: a chain that starts badly twisted may end in a local minimum.

#include "gelslam/backend/pose_graph.hpp"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>

#include <algorithm>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/core/index.hpp"
#include "loop_layers.hpp"

namespace gelslam {
namespace {

using namespace backend::detail;

bool is_pose(const Pose& pose) {
  // Larger than rounding errors in products of rotations, smaller than any real mistake.
  constexpr double kTolerance = 1e-3;
  return pose.matrix().allFinite() && pose.linear().isUnitary(kTolerance) && pose.linear().determinant() > 0;
}

/// The graph with its nodes as indices in ascending order of their ids; edges refer to these indices.
struct Graph {
  std::vector<int> ids;
  std::vector<NodeState> nodes;
  std::vector<WhitenedEdge> edges;
  std::vector<int> component;  // For each node, the index of the smallest node of its component.
  // Upper Cholesky factor of the prior information of the shared unknowns.
  Eigen::MatrixXd prior_whitening;
};

Graph make_graph(const std::map<int, Pose>& initial_map_T_node, const std::vector<PoseGraphEdge>& edges) {
  Graph graph;
  for (const auto& [id, pose] : initial_map_T_node) {
    if (!is_pose(pose))
      throw Error("pose graph: the initial pose of node " + std::to_string(id) + " is not a pose");
    graph.ids.push_back(id);
    graph.nodes.push_back(to_state(pose));
  }
  const auto index_of = [&](int id) {
    const auto it = std::lower_bound(graph.ids.begin(), graph.ids.end(), id);
    if (it == graph.ids.end() || *it != id)
      throw Error("pose graph: an edge names node " + std::to_string(id) + ", which has no initial pose");
    return static_cast<int>(it - graph.ids.begin());
  };
  UnionFind components(static_cast<int>(graph.ids.size()));
  for (const PoseGraphEdge& edge : edges) {
    if (edge.from == edge.to)
      throw Error("pose graph: an edge joins node " + std::to_string(edge.from) + " to itself");
    if (!is_pose(edge.from_T_to))
      throw Error("pose graph: the edge " + std::to_string(edge.from) + " -> " + std::to_string(edge.to) +
                  " does not carry a pose");
    graph.edges.push_back({index_of(edge.from), index_of(edge.to),
                           Eigen::Quaterniond(edge.from_T_to.linear()).normalized(),
                           edge.from_T_to.translation(), whitening_matrix(edge.information), edge.kind});
    components.join(graph.edges.back().from, graph.edges.back().to);
  }
  for (int i = 0; i < static_cast<int>(graph.ids.size()); ++i) graph.component.push_back(components.root(i));
  return graph;
}

/// Sets each edge's whitened derivative with respect to the shared unknowns.
void add_shared_unknowns(const SharedUnknowns& shared, Graph& graph) {
  const Eigen::Index count = shared.information.rows();
  if (count == 0 && shared.edge_by_unknown.empty()) return;
  const Eigen::LLT<Eigen::MatrixXd> factor(shared.information);
  if (shared.edge_by_unknown.size() != graph.edges.size() || shared.information.cols() != count ||
      !shared.information.allFinite() || factor.info() != Eigen::Success)
    throw Error("pose graph: shared unknowns need a derivative per edge and a positive definite information");
  graph.prior_whitening = factor.matrixU();
  for (std::size_t i = 0; i < graph.edges.size(); ++i) {
    const auto& by_unknown = shared.edge_by_unknown[i];
    if (by_unknown.cols() != count || !by_unknown.allFinite())
      throw Error(
          "pose graph: an edge's derivative by the shared unknowns has the wrong size or is not finite");
    graph.edges[i].by_unknown = graph.edges[i].whitening * by_unknown;
  }
}

/// The robust kernel of loops for Ceres: robust_cost() with all widths multiplied by `widening`. With
/// widening 1 it becomes constant where is_outlier() begins.
class LoopLoss : public ceres::LossFunction {
 public:
  LoopLoss(double scale, double widening)
      : cauchy_(widening * scale), limit_(widening * kMaxMismatch * widening * kMaxMismatch) {}

  void Evaluate(double squared_norm, double rho[3]) const override {
    cauchy_.Evaluate(std::min(squared_norm, limit_), rho);
    if (squared_norm > limit_) rho[1] = rho[2] = 0;
  }

 private:
  const ceres::CauchyLoss cauchy_;
  const double limit_;
};

/// Residual of an edge: the whitened pose error, minus the effect of the shared unknowns where there are any.
class EdgeCost : public ceres::CostFunction {
 public:
  explicit EdgeCost(const WhitenedEdge& edge) : edge_(edge), of_nodes_(new OfNodes{&edge_}) {
    set_num_residuals(6);
    *mutable_parameter_block_sizes() = {7, 7};
    if (unknowns() > 0) mutable_parameter_block_sizes()->push_back(unknowns());
  }

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    if (!of_nodes_.Evaluate(parameters, residuals, jacobians)) return false;
    if (unknowns() == 0) return true;
    const Eigen::Map<const Eigen::VectorXd> values(parameters[2], unknowns());
    Eigen::Map<Vector6d>(residuals).noalias() -= edge_.by_unknown * values;
    if (jacobians && jacobians[2])
      Eigen::Map<Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor>>(jacobians[2], 6, unknowns()) =
          -edge_.by_unknown;
    return true;
  }

 private:
  struct OfNodes {
    const WhitenedEdge* edge;

    template <typename T>
    bool operator()(const T* from, const T* to, T* residual) const {
      Eigen::Map<Eigen::Matrix<T, 6, 1>> r(residual);
      r = whitened_error(*edge, from, to);
      return true;
    }
  };

  int unknowns() const { return static_cast<int>(edge_.by_unknown.cols()); }

  const WhitenedEdge& edge_;  // Refers to the graph, which outlives the problem.
  ceres::AutoDiffCostFunction<OfNodes, 6, 7, 7> of_nodes_;
};

/// Values of all unknowns, with the residuals that they give.
struct Estimate {
  std::vector<NodeState> nodes;
  Eigen::VectorXd unknowns;
  std::vector<double> residuals;
  double worst_loop = 0;
  double cost = 0;
};

/// The graph as a Ceres problem over its own copy of the unknowns. All loops share one loss function.
class Solver {
 public:
  Solver(const Graph& graph, const PoseGraphOptions& options)
      : graph_(graph),
        options_(options),
        loop_loss_(nullptr, ceres::TAKE_OWNERSHIP),
        problem_(problem_options()) {}

  /// Minimizes the cost from the values in `estimate`, with the loops' kernel `widening` times as wide as in
  /// the options. The result replaces the values in `estimate` if Ceres reports a usable solution.
  ceres::Solver::Summary solve(Estimate& estimate, double widening = 1) {
    if (nodes_.empty()) build(estimate);
    nodes_ = estimate.nodes;
    unknowns_ = estimate.unknowns;
    loop_loss_.Reset(new LoopLoss(options_.loop_loss_scale, widening), ceres::TAKE_OWNERSHIP);

    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    // Eigen adds in a fixed order. A BLAS with threads would not, and results would not be repeatable.
    solver.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
    solver.num_threads = 1;
    // The large initial trust region makes the steps nearly Gauss-Newton steps. With Ceres' default, the
    // weakly determined modes of a long chain need many steps.
    solver.initial_trust_region_radius = 1e8;
    solver.function_tolerance = 1e-6;
    solver.gradient_tolerance = 1e-10;
    solver.parameter_tolerance = 1e-9;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem_, &summary);
    if (summary.IsSolutionUsable()) {
      estimate.nodes = nodes_;
      estimate.unknowns = unknowns_;
    }
    return summary;
  }

 private:
  static ceres::Problem::Options problem_options() {
    ceres::Problem::Options options;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.disable_all_safety_checks =
        true;  // These checks look up the blocks of every edge, which build() cannot confuse.
    return options;
  }

  void build(const Estimate& estimate) {
    nodes_ = estimate.nodes;
    unknowns_ = estimate.unknowns;
    for (const WhitenedEdge& edge : graph_.edges) add(edge);
    if (unknowns_.size() > 0)
      problem_.AddResidualBlock(
          new ceres::NormalPrior(graph_.prior_whitening, Eigen::VectorXd::Zero(unknowns_.size())), nullptr,
          unknowns_.data());
    for (int i = 0; i < static_cast<int>(nodes_.size()); ++i) {
      double* node = nodes_[index(i)].data();
      if (!problem_.HasParameterBlock(node)) continue;
      problem_.SetManifold(node, &manifold_);
      if (graph_.component[index(i)] == i) problem_.SetParameterBlockConstant(node);
    }
  }

  void add(const WhitenedEdge& edge) {
    ceres::LossFunction* loss = edge.kind == EdgeKind::loop ? &loop_loss_ : nullptr;
    std::vector<double*> blocks = {nodes_[index(edge.from)].data(), nodes_[index(edge.to)].data()};
    if (edge.by_unknown.cols() > 0) blocks.push_back(unknowns_.data());
    problem_.AddResidualBlock(new EdgeCost(edge), loss, blocks);
  }

  const Graph& graph_;
  const PoseGraphOptions& options_;
  std::vector<NodeState> nodes_;
  Eigen::VectorXd unknowns_;
  ceres::LossFunctionWrapper loop_loss_;
  ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>> manifold_;
  ceres::Problem problem_;
};

void evaluate(const Graph& graph, const PoseGraphOptions& options, Estimate& estimate) {
  estimate.residuals.clear();
  estimate.worst_loop = 0;
  double twice_cost = 0;
  if (estimate.unknowns.size() > 0) twice_cost += (graph.prior_whitening * estimate.unknowns).squaredNorm();
  for (const WhitenedEdge& edge : graph.edges) {
    const double r = residual_norm(edge, estimate.nodes[index(edge.from)], estimate.nodes[index(edge.to)],
                                   estimate.unknowns);
    estimate.residuals.push_back(r);
    if (edge.kind == EdgeKind::loop) estimate.worst_loop = std::max(estimate.worst_loop, r);
    twice_cost += edge.kind == EdgeKind::loop ? robust_cost(r, options.loop_loss_scale) : r * r;
  }
  estimate.cost = twice_cost / 2;
}

/// Solves with a sequence of kernels from wide to narrow (graduated non-convexity).
Estimate solve_from_wide_kernel(Solver& solver, const Graph& graph, const PoseGraphOptions& options,
                                Estimate estimate, int& iterations) {
  const double widest = estimate.worst_loop / std::min(options.loop_loss_scale, kMaxMismatch);
  for (const double widening : kernel_widenings(widest))
    iterations += static_cast<int>(solver.solve(estimate, widening).iterations.size());
  evaluate(graph, options, estimate);
  return estimate;
}

PoseGraphSolution describe(const Graph& graph, const Estimate& estimate) {
  PoseGraphSolution solution;
  for (std::size_t i = 0; i < graph.ids.size(); ++i) {
    solution.component_T_node.emplace(graph.ids[i], to_pose(estimate.nodes[i]));
    solution.component_of_node.emplace(graph.ids[i], graph.ids[index(graph.component[i])]);
  }
  solution.shared_unknowns = estimate.unknowns;
  solution.edge_residual = estimate.residuals;
  for (std::size_t i = 0; i < graph.edges.size(); ++i)
    solution.edge_outlier.push_back(is_outlier(graph.edges[i].kind, estimate.residuals[i]));
  solution.final_cost = estimate.cost;
  return solution;
}

PoseGraphSolution solve(const Graph& graph, const PoseGraphOptions& options) {
  Estimate estimate;
  estimate.nodes = graph.nodes;
  estimate.unknowns = Eigen::VectorXd::Zero(graph.prior_whitening.rows());
  evaluate(graph, options, estimate);
  if (graph.edges.empty()) return describe(graph, estimate);

  Solver solver(graph, options);
  int iterations = static_cast<int>(solver.solve(estimate).iterations.size());
  evaluate(graph, options, estimate);
  if (estimate.worst_loop > kMaxMismatch) {
    Estimate second = solve_from_wide_kernel(solver, graph, options, estimate, iterations);
    if (second.cost < estimate.cost) estimate = std::move(second);
  }
  PoseGraphSolution solution = describe(graph, estimate);
  solution.iterations = iterations;
  return solution;
}

}  // namespace

PoseGraphSolution solve_pose_graph(const std::map<int, Pose>& initial_map_T_node,
                                   const std::vector<PoseGraphEdge>& edges, const PoseGraphOptions& options,
                                   const SharedUnknowns& shared) {
  if (!(options.loop_loss_scale > 0)) throw Error("pose graph: loop_loss_scale must be positive");
  Graph graph = make_graph(initial_map_T_node, edges);
  add_shared_unknowns(shared, graph);
  return solve(graph, options);
}

}  // namespace gelslam
