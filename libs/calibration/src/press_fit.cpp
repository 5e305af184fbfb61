#include "press_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace gelslam::calibration::detail {
namespace {

constexpr int features = 5;          // sx, sy, sx^2, sx sy, sy^2
constexpr double loss_scale = 0.05;  // relative colour change; noise is a third of it
constexpr int max_iterations = 25;
constexpr double step_px = 0.05;  // of the numerical derivatives
constexpr double converged_px = 0.01;

using Features = Eigen::Matrix<double, Eigen::Dynamic, features>;
using Changes = Eigen::Matrix<double, Eigen::Dynamic, 3>;
using Parameters = Eigen::Vector4d;

Parameters bounded(Parameters p, double ball_px) {
  p[2] = std::clamp(p[2], 3.0, 0.98 * ball_px);
  p[3] = std::clamp(p[3], 1.0, 60.0);
  return p;
}

void fill_features(const PressPoints& points, const Parameters& p, double ball_px, Features& f) {
  const double squared = ball_px * ball_px;
  const double rim = 1.0 / std::sqrt(squared - p[2] * p[2]);  // slope over distance at the contact's rim
  for (Eigen::Index k = 0; k < f.rows(); ++k) {
    const auto point = static_cast<std::size_t>(k);
    const double x = points.u_px[point] - p[0], y = points.v_px[point] - p[1];
    const double distance = std::sqrt(x * x + y * y);
    const double slope_over_distance = distance <= p[2]
                                           ? 1.0 / std::sqrt(squared - distance * distance)
                                           : rim * p[2] / distance * std::exp((p[2] - distance) / p[3]);
    const double sx = slope_over_distance * x, sy = slope_over_distance * y;
    f.row(k) << sx, sy, sx * sx, sx * sy, sy * sy;
  }
}

class Fitter {
 public:
  Fitter(const PressPoints& points, double ball_px)
      : points_(points),
        ball_px_(ball_px),
        size_(static_cast<Eigen::Index>(points.u_px.size())),
        features_(size_, features),
        changes_(size_, 3),
        weights_(Eigen::VectorXd::Ones(size_)) {
    for (int channel = 0; channel < 3; ++channel)
      changes_.col(channel) =
          Eigen::Map<const Eigen::VectorXd>(points.change[static_cast<std::size_t>(channel)].data(), size_);
  }

  PressFit run(const PressShape& start) {
    Parameters p = bounded({start.u_px, start.v_px, start.radius_px, start.decay_px}, ball_px_);
    Changes residuals = residuals_at(p);
    double damping = 1e-3;
    for (int iteration = 0; iteration < max_iterations; ++iteration) {
      reweight(residuals);
      residuals = residuals_at(p);
      const Parameters step = improve(p, residuals, damping);
      if (step.cwiseAbs().maxCoeff() < converged_px) break;
    }
    const double total = (weights_.asDiagonal() * changes_.cwiseAbs2()).sum();
    const double left = (weights_.asDiagonal() * residuals.cwiseAbs2()).sum();
    return {{p[0], p[1], p[2], p[3]}, robust_cost(residuals), total > 0.0 ? 1.0 - left / total : 0.0};
  }

 private:
  /// What is left of the colours when the best colour function of this shape's slopes is taken away.
  Changes residuals_at(const Parameters& p) {
    fill_features(points_, p, ball_px_, features_);
    const Features weighted = weights_.asDiagonal() * features_;
    Eigen::Matrix<double, features, features> information = weighted.transpose() * features_;
    information.diagonal().array() += 1e-9 * information.trace() + 1e-12;
    const Eigen::Matrix<double, features, 3> colours =
        information.ldlt().solve(weighted.transpose() * changes_);
    return changes_ - features_ * colours;
  }

  void reweight(const Changes& residuals) {
    weights_ = (1.0 + residuals.rowwise().squaredNorm().array() / (loss_scale * loss_scale)).rsqrt();
  }

  double robust_cost(const Changes& residuals) const {
    const auto squared = residuals.rowwise().squaredNorm().array() / (loss_scale * loss_scale);
    return ((1.0 + squared).sqrt() - 1.0).mean();
  }

  double weighted_cost(const Changes& residuals) const {
    return (weights_.array() * residuals.rowwise().squaredNorm().array()).sum();
  }

  /// One accepted step (or none); residuals and damping follow.
  Parameters improve(Parameters& p, Changes& residuals, double& damping) {
    std::array<Changes, 4> derivatives;
    for (int i = 0; i < 4; ++i) {
      Parameters moved = p;
      moved[i] += moved[i] + step_px > 0.98 * ball_px_ && i == 2 ? -step_px : step_px;
      derivatives[static_cast<std::size_t>(i)] = (residuals_at(moved) - residuals) / (moved[i] - p[i]);
    }
    Eigen::Matrix4d information;
    Parameters right;
    for (int i = 0; i < 4; ++i) {
      const Changes weighted = weights_.asDiagonal() * derivatives[static_cast<std::size_t>(i)];
      right[i] = -weighted.cwiseProduct(residuals).sum();
      for (int j = 0; j <= i; ++j)
        information(i, j) = information(j, i) =
            weighted.cwiseProduct(derivatives[static_cast<std::size_t>(j)]).sum();
    }
    const double before = weighted_cost(residuals);
    for (int attempt = 0; attempt < 6; ++attempt) {
      Eigen::Matrix4d damped = information;
      damped.diagonal() *= 1.0 + damping;
      damped.diagonal().array() += 1e-9;
      const Parameters step = damped.ldlt().solve(right);
      const Parameters next = bounded(p + step, ball_px_);
      const Changes there = residuals_at(next);
      if (step.allFinite() && weighted_cost(there) <= before) {
        const Parameters done = next - p;
        p = next;
        residuals = there;
        damping = std::max(1e-6, damping * 0.3);
        return done;
      }
      damping *= 5.0;
    }
    return Parameters::Zero();
  }

  const PressPoints& points_;
  double ball_px_;
  Eigen::Index size_;
  Features features_;
  Changes changes_;
  Eigen::VectorXd weights_;
};

}  // namespace

PressFit fit_press(const PressPoints& points, const PressShape& start, double ball_px) {
  return Fitter(points, ball_px).run(start);
}

}  // namespace gelslam::calibration::detail
