#include "gelslam/backend/pose_covariance.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <utility>

#include "gelslam/backend/uncertain_motion.hpp"
#include "gelslam/core/error.hpp"
#include "whitened_graph.hpp"

namespace gelslam {
namespace {

using namespace backend::detail;
using Sparse = Eigen::SparseMatrix<double>;
using Rows6 = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// The information matrix of all unknowns, of which the lower half is filled.
class InformationMatrix {
 public:
  explicit InformationMatrix(int size) : size_(size) {}

  /// Residuals of unit variance depend on the unknowns from `first` on by `derivative`.
  void add(const std::vector<std::pair<int, Rows6>>& derivatives) {
    for (const auto& [row, by_row] : derivatives)
      for (const auto& [column, by_column] : derivatives)
        add_block(row, column, by_row.transpose() * by_column);
  }

  void add_block(int row, int column, const Eigen::MatrixXd& block) {
    for (int r = 0; r < block.rows(); ++r)
      for (int c = 0; c < block.cols(); ++c)
        if (row + r >= column + c) entries_.emplace_back(row + r, column + c, block(r, c));
  }

  Sparse matrix() const {
    Sparse matrix(size_, size_);
    matrix.setFromTriplets(entries_.begin(), entries_.end());
    return matrix;
  }

 private:
  int size_;
  std::vector<Eigen::Triplet<double>> entries_;
};

}  // namespace

std::map<int, Matrix6d> pose_covariances(const std::vector<PoseGraphEdge>& edges,
                                         const PoseGraphSolution& solution, int gauge,
                                         const PoseGraphOptions& options, double gradient_scale_sigma) {
  if (solution.edge_residual.size() != edges.size() || solution.edge_outlier.size() != edges.size())
    throw Error("pose graph: the solution is of other edges");
  const int component = solution.component_of_node.at(gauge);
  std::map<int, int> row_of;
  for (const auto& [id, of_node] : solution.component_of_node)
    if (of_node == component && id != gauge) row_of.emplace(id, 6 * static_cast<int>(row_of.size()));
  const SharedUnknowns scale =
      gradient_scale_sigma > 0 ? gradient_scale_unknowns(edges, gradient_scale_sigma) : SharedUnknowns{};
  const int scale_row = 6 * static_cast<int>(row_of.size());
  InformationMatrix information(scale_row + static_cast<int>(scale.information.rows()));
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const PoseGraphEdge& edge = edges[i];
    if (solution.edge_outlier[i] || solution.component_of_node.at(edge.from) != component) continue;
    Matrix6d whitening = whitening_matrix(edge.information);
    if (edge.kind == EdgeKind::loop)
      whitening *= std::sqrt(robust_weight(solution.edge_residual[i], options.loop_loss_scale));
    const Pose to_T_from =
        solution.component_T_node.at(edge.to).inverse() * solution.component_T_node.at(edge.from);
    std::vector<std::pair<int, Rows6>> derivatives;
    if (edge.to != gauge) derivatives.emplace_back(row_of.at(edge.to), whitening);
    if (edge.from != gauge) derivatives.emplace_back(row_of.at(edge.from), -whitening * adjoint(to_T_from));
    if (gradient_scale_sigma > 0) derivatives.emplace_back(scale_row, -whitening * scale.edge_by_unknown[i]);
    information.add(derivatives);
  }
  if (gradient_scale_sigma > 0) information.add_block(scale_row, scale_row, scale.information);

  std::map<int, Matrix6d> covariances;
  covariances[gauge] = Matrix6d::Zero();
  if (row_of.empty()) return covariances;
  const Eigen::SimplicialLDLT<Sparse> factor(information.matrix());
  if (factor.info() != Eigen::Success) throw Error("pose graph: its edges do not determine its poses");
  Eigen::MatrixXd columns(factor.rows(), 6);
  for (const auto& [id, row] : row_of) {
    columns.setZero();
    columns.middleRows<6>(row).setIdentity();
    covariances[id] = symmetric(factor.solve(columns).middleRows<6>(row));
  }
  return covariances;
}

}  // namespace gelslam
