// Computes the covariances of all poses of a solved pose graph, and how each pose depends on the gradient
// scale.
//
// At the solution, the information of the poses is H = Σ JᵀJ over the whitened Jacobians of all edges that
// are no outliers, where a loop has the weight that its robust kernel leaves. Where only outliers join two
// parts of a component, the first such edge counts with nothing but the weak prior of overlapping frames.
// Each component has a gauge node with covariance 0: the anchor, or the component's smallest node. The
// covariance of a node is a diagonal block of H⁻¹. From the sparse Cholesky factor H = L Lᵀ, the entries of
// the inverse where L has non-zeros are computed from the last column to the first (selected inverse;
// Takahashi et al. 1973). This costs about as much as the factorization, and far less than a dense inverse.
//
// If the four factors s of the gradient scale are estimated, the poses depend on them by dx/ds = -H⁻¹ Hxs,
// and the covariance of s is the inverse of the Schur complement of s, with its prior included. Both results
// are linearizations at the solution: the covariances are too small where the graph has several minima, and
// where registrations share errors that their information does not contain.
// their information does not contain.

#include "gelslam/backend/pose_covariance.hpp"

#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/index.hpp"
#include "whitened_graph.hpp"

namespace gelslam {
namespace {

using namespace backend::detail;
using Sparse = Eigen::SparseMatrix<double>;
using ByScale = Eigen::Matrix<double, Eigen::Dynamic, kScaleTerms>;

/// Returns the lower half of Z = (L Lᵀ)⁻¹ at the non-zeros of L, column by column from the last. The
/// recursion follows from Z L = L⁻ᵀ being upper triangular: below the diagonal, column j of Z is -Z_II l,
/// where I are the rows of the non-zeros of L below the diagonal of column j, and l are these non-zeros
/// divided by the diagonal entry. All needed entries of Z_II lie at non-zeros of L, too.
Sparse selected_inverse(const Sparse& lower) {
  Sparse inverse = lower;
  const int *column = lower.outerIndexPtr(), *row = lower.innerIndexPtr();
  double* value = inverse.valuePtr();
  Eigen::VectorXd l = Eigen::VectorXd::Zero(lower.rows()), z = l;
  for (auto j = lower.cols() - 1; j >= 0; --j) {
    const int first = column[j], end = column[j + 1];  // The first entry of a column is the diagonal.
    const double diagonal = value[first];
    for (int p = first + 1; p < end; ++p) {
      l[row[p]] = value[p] / diagonal;
      z[row[p]] = 0;
    }
    for (int p = first + 1; p < end; ++p) {
      const int i = row[p];
      z[i] -= value[column[i]] * l[i];
      for (int q = column[i] + 1; q < column[i + 1]; ++q) {
        z[row[q]] -= value[q] * l[i];
        z[i] -= value[q] * l[row[q]];
      }
    }
    value[first] = 1.0 / (diagonal * diagonal);
    for (int p = first + 1; p < end; ++p) {
      value[p] = z[row[p]];
      value[first] -= value[p] * std::exchange(l[row[p]], 0.0);
    }
  }
  return inverse;
}

/// Information matrix over the poses of all nodes but the gauges, and its mixed block with the gradient
/// scale.
struct Information {
  std::map<int, int> row_of;  // Row of a node's first unknown; -1 for a gauge node.
  std::vector<Eigen::Triplet<double>> entries;
  ByScale with_scale;
  ScaleCovariance of_scale = ScaleCovariance::Zero();

  void add(int row, int column, const Matrix6d& block) {
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < 6; ++c)
        if (row + r >= column + c) entries.emplace_back(row + r, column + c, block(r, c));
  }
};

Information information_of(const std::vector<PoseGraphEdge>& edges, const PoseGraphSolution& solution,
                           int anchor, const PoseGraphOptions& options) {
  Information all;
  int rows = 0;
  const auto anchored = solution.component_of_node.find(anchor);
  for (const auto& [id, component] : solution.component_of_node) {
    const bool has_anchor = anchored != solution.component_of_node.end() && anchored->second == component;
    const bool is_gauge = id == (has_anchor ? anchor : component);
    all.row_of[id] = is_gauge ? -1 : std::exchange(rows, rows + 6);
  }
  all.with_scale = ByScale::Zero(rows, kScaleTerms);
  UnionFind known(all.row_of.empty() ? 0 : all.row_of.rbegin()->first + 1);
  for (std::size_t i = 0; i < edges.size(); ++i)
    if (!solution.edge_outlier[i]) known.join(edges[i].from, edges[i].to);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const PoseGraphEdge& edge = edges[i];
    const bool outlier = solution.edge_outlier[i];
    if (outlier && known.root(edge.from) == known.root(edge.to)) continue;
    known.join(edge.from, edge.to);
    Matrix6d whitening = whitening_matrix(outlier ? Matrix6d::Zero() : edge.information);
    if (edge.kind == EdgeKind::loop && !outlier)
      whitening *= std::sqrt(robust_weight(solution.edge_residual[i], options.loop_loss_scale));
    const Pose to_T_from =
        solution.component_T_node.at(edge.to).inverse() * solution.component_T_node.at(edge.from);
    const MotionByScale by_scale = -whitening * motion_by_gradient_scale(edge);
    const std::pair<int, Matrix6d> by_node[] = {{all.row_of.at(edge.to), whitening},
                                                {all.row_of.at(edge.from), -whitening * adjoint(to_T_from)}};
    for (const auto& [row, by_row] : by_node) {
      if (row < 0) continue;
      for (const auto& [column, by_column] : by_node)
        if (column >= 0) all.add(row, column, by_row.transpose() * by_column);
      all.with_scale.middleRows<6>(row) += by_row.transpose() * by_scale;
    }
    all.of_scale += by_scale.transpose() * by_scale;
  }
  return all;
}

}  // namespace

PoseCovariances pose_covariances(const std::vector<PoseGraphEdge>& edges, const PoseGraphSolution& solution,
                                 int anchor, const PoseGraphOptions& options, double gradient_scale_sigma) {
  if (solution.edge_residual.size() != edges.size() || solution.edge_outlier.size() != edges.size())
    throw Error("pose graph: the solution is of other edges");
  const Information all = information_of(edges, solution, anchor, options);
  PoseCovariances result;
  for (const auto& [id, pose] : solution.component_T_node) result.component_T_node[id].from_T_to.pose = pose;
  const auto rows = static_cast<int>(all.with_scale.rows());
  Sparse information(rows, rows);
  information.setFromTriplets(all.entries.begin(), all.entries.end());
  const Eigen::SimplicialLLT<Sparse> factor(information);
  if (factor.info() != Eigen::Success) throw Error("pose graph: its edges do not determine its poses");
  const Sparse inverse = rows > 0 ? selected_inverse(factor.matrixL()) : information;
  const auto& place = factor.permutationP().indices();  // Position of an unknown in the permuted factor.
  ByScale by_scale = ByScale::Zero(rows, kScaleTerms);
  if (gradient_scale_sigma > 0) {
    if (rows > 0) by_scale = -factor.solve(all.with_scale);
    result.scale = (ScaleCovariance(prior_scale_covariance(gradient_scale_sigma).inverse()) + all.of_scale +
                    all.with_scale.transpose() * by_scale)
                       .inverse();
  }
  for (const auto& [id, row] : all.row_of) {
    if (row < 0) continue;
    UncertainMotion& node = result.component_T_node.at(id);
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < 6; ++c) {
        const auto [column, below] = std::minmax(place[row + r], place[row + c]);
        node.from_T_to.covariance(r, c) = inverse.coeff(below, column);
      }
    node.by_scale = by_scale.middleRows<6>(row);
  }
  return result;
}

}  // namespace gelslam
