#include "press_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

namespace gelslam::calibration::detail {
namespace {

constexpr double loss_scale = 0.05;  // relative colour change; noise is a third of it
constexpr int max_iterations = 25;
constexpr double step_px = 0.05;  // of the numerical derivatives
constexpr double converged_px = 0.01;

using Changes = Eigen::Matrix<double, Eigen::Dynamic, 3>;
using Parameters = Eigen::Vector4d;

Parameters bounded(Parameters p, double ball_px) {
  p[2] = std::clamp(p[2], 3.0, 0.98 * ball_px);
  p[3] = std::clamp(p[3], 1.0, 60.0);
  return p;
}

/// Terms of a polynomial in sx and sy without its constant: 5 of degree 2, 14 of degree 4.
constexpr int terms_of(int degree) { return (degree + 1) * (degree + 2) / 2 - 1; }

template <int degree, class Row>
void fill_terms(double sx, double sy, Row row) {
  std::array<double, degree + 1> power_x{1.0}, power_y{1.0};
  int term = 0;
  for (std::size_t k = 1; k <= degree; ++k) {
    power_x[k] = power_x[k - 1] * sx;
    power_y[k] = power_y[k - 1] * sy;
    for (std::size_t j = 0; j <= k; ++j) row[term++] = power_x[k - j] * power_y[j];
  }
}

template <int degree>
class Fitter {
  static constexpr int features = terms_of(degree);
  using Features = Eigen::Matrix<double, Eigen::Dynamic, features>;

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
  void fill_features(const Parameters& p) {
    const double squared = ball_px_ * ball_px_;
    const double rim = 1.0 / std::sqrt(squared - p[2] * p[2]);  // slope over distance at the contact's rim
    for (Eigen::Index k = 0; k < size_; ++k) {
      const auto point = static_cast<std::size_t>(k);
      const double x = points_.u_px[point] - p[0], y = points_.v_px[point] - p[1];
      const double distance = std::sqrt(x * x + y * y);
      const double slope_over_distance = distance <= p[2]
                                             ? 1.0 / std::sqrt(squared - distance * distance)
                                             : rim * p[2] / distance * std::exp((p[2] - distance) / p[3]);
      fill_terms<degree>(slope_over_distance * x, slope_over_distance * y, features_.row(k));
    }
  }

  /// What is left of the colours when the best colour function of this shape's slopes is taken away.
  Changes residuals_at(const Parameters& p) {
    fill_features(p);
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
  return Fitter<2>(points, ball_px).run(start);
}

PressFit refine_press(const PressPoints& points, const PressShape& start, double ball_px) {
  return Fitter<4>(points, ball_px).run(start);
}

}  // namespace gelslam::calibration::detail
