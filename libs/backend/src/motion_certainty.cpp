#include "gelslam/backend/motion_certainty.hpp"

#include <Eigen/Eigenvalues>
#include <limits>
#include <map>

#include "motion_forest.hpp"

namespace gelslam {

using namespace backend::detail;

struct MotionCertainty::Impl {
  std::map<int, int> node_of;
  MotionForest forest;
  double gradient_scale_sigma;
};

MotionCertainty::MotionCertainty(const std::vector<PoseGraphEdge>& edges, double gradient_scale_sigma) {
  std::map<int, int> node_of;
  std::vector<UncertainMotion> motions;
  std::vector<MotionForest::Edge> links;
  motions.reserve(edges.size());
  const auto number = [&](int id) {
    return node_of.try_emplace(id, static_cast<int>(node_of.size())).first->second;
  };
  for (const PoseGraphEdge& edge : edges) {
    motions.push_back(uncertain_motion(edge));
    links.push_back({number(edge.from), number(edge.to), &motions.back()});
  }
  const int nodes = static_cast<int>(node_of.size());
  impl_.reset(new Impl{std::move(node_of), MotionForest(nodes, links), gradient_scale_sigma});
}

MotionCertainty::~MotionCertainty() = default;

double MotionCertainty::sigma_mm(int from, int to) const {
  const auto a = impl_->node_of.find(from), b = impl_->node_of.find(to), none = impl_->node_of.end();
  if (a == none || b == none || impl_->forest.tree(a->second) != impl_->forest.tree(b->second))
    return std::numeric_limits<double>::infinity();
  const UncertainMotion path = impl_->forest.path(a->second, b->second);
  const Eigen::Matrix3d covariance =
      path.covariance_with_scale(impl_->gradient_scale_sigma).bottomRightCorner<3, 3>();
  return std::sqrt(
      std::max(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues().maxCoeff(), 0.0));
}

}  // namespace gelslam
