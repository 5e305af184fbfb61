#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "baselines/baselines.hpp"
#include "contact_points.hpp"
#include "gaussian_grid.hpp"

namespace gelslam {
namespace {

using namespace baselines::detail;

constexpr double kMinVarianceMm2 =
    0.0025;  // A finer grid over a whole sensor would take too much memory and time.

/// Normal equations of one maximization step.
struct PlaneEquations {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double weight = 0, squared_mm2 = 0;
  std::size_t partners = 0;

  double mean_squared_mm2() const { return weight > 0 ? squared_mm2 / weight : 0; }
};

/// Returns the normal equations of the sum over the reference's points of w (n . (x - y))² at the current
/// pose. y and n are the mean position and normal of the target's Gaussians at x, and w is the probability
/// that x has a corresponding point at all (Gao & Tedrake 2019, §4: E step and twist).
PlaneEquations expect(const ContactPoints& reference, const GaussianGrid& target,
                      const Pose& target_T_reference, double outlier_weight) {
  PlaneEquations equations;
  for (const Eigen::Vector3d& point : reference.position_mm) {
    const Eigen::Vector3d x = target_T_reference * point;
    const GaussianGrid::Sums near = target.at(x);
    if (near.weight <= 0) continue;
    const Eigen::Vector3d n = near.normal.normalized();
    const double w = near.weight / (near.weight + outlier_weight), distance = n.dot(x - near.position_mm);
    Vector6d row;  // Derivative with respect to a motion in the target's frame: rotation, then translation.
    row << x.cross(n), n;
    equations.hessian += w * row * row.transpose();
    equations.gradient += w * distance * row;
    equations.weight += w;
    equations.squared_mm2 += w * distance * distance;
    ++equations.partners;
  }
  return equations;
}

/// Solves the equations for a step. The damping keeps it small along directions that no plane determines.
Vector6d maximise(const PlaneEquations& equations) {
  Matrix6d damped = equations.hessian;
  damped.diagonal().array() += 1e-6 * equations.weight;
  return -damped.ldlt().solve(equations.gradient);
}

class FilterReg {
 public:
  FilterReg(const Surface& reference, const FilterRegOptions& options)
      : options_(options), points_(contact_points(reference, options.max_points)) {}

  Pose align(const Surface& target, Pose target_T_reference) const {
    const ContactPoints target_points = contact_points(target, options_.max_points);
    if (std::min(points_.size(), target_points.size()) < kMinPoints) return target_T_reference;
    const GaussianGrid grid(target_points, std::sqrt(std::max(options_.variance_mm2, kMinVarianceMm2)));
    const double ratio = static_cast<double>(target_points.size()) / static_cast<double>(points_.size());
    const double outlier_weight = ratio * options_.outlier_share / (1.0 - options_.outlier_share);
    double before_mm2 = -1;
    for (int i = 0; i < options_.max_iterations; ++i) {
      const PlaneEquations equations = expect(points_, grid, target_T_reference, outlier_weight);
      if (equations.partners < kMinPoints) break;
      const double now_mm2 = equations.mean_squared_mm2();
      if (before_mm2 >= 0 && std::abs(before_mm2 - now_mm2) < options_.tolerance_mm2) break;
      before_mm2 = now_mm2;
      target_T_reference = normalized(se3_exp(maximise(equations)) * target_T_reference);
    }
    return target_T_reference;
  }

 private:
  FilterRegOptions options_;
  ContactPoints points_;
};

}  // namespace

Registrar make_filter_reg(const FilterRegOptions& options, const NormalFlowOptions& judged_by) {
  return baseline_registrar<FilterReg>(options, judged_by);
}

}  // namespace gelslam
