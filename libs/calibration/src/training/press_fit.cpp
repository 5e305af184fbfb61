#include "training/press_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace gelslam::calibration::detail {
namespace {

constexpr double kLossScale = 0.05;  // relative color change; noise is a third of it
constexpr int kMaxFitIterations = 25;
constexpr double kFitStepPx = 0.05;  // of the numerical derivatives
constexpr double kConvergedPx = 0.01;
constexpr double kFirstSmear = 0.25;  // of the radius: where the search for blur and movement starts

using Changes = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// A place from which a picture was also taken, and how much it counts.
struct Glimpse {
  double u_px = 0.0, v_px = 0.0, share = 1.0;
};

/// One picture, taken at once.
struct Sharp {
  static constexpr int parameters = 0;
  using Values = Eigen::Matrix<double, 4, 1>;
  static std::array<Glimpse, 1> glimpses(const Values&) { return {}; }
};

/// The ball moved along (p[4], p[5]) while the picture was taken.
struct Slid {
  static constexpr int parameters = 2;
  using Values = Eigen::Matrix<double, 6, 1>;
  static std::array<Glimpse, 5> glimpses(const Values& p) {
    std::array<Glimpse, 5> result;
    for (std::size_t k = 0; k < result.size(); ++k) {
      const double along = 0.2 * static_cast<double>(k) - 0.4;
      result[k] = {along * p[4], along * p[5], 0.2};
    }
    return result;
  }
};

/// Blurred by a Gaussian of p[4] pixels: Radon's seven points.
struct Blurred {
  static constexpr int parameters = 1;
  using Values = Eigen::Matrix<double, 5, 1>;
  static std::array<Glimpse, 7> glimpses(const Values& p) {
    std::array<Glimpse, 7> result;
    result[0] = {0.0, 0.0, 0.5};
    for (std::size_t k = 1; k < result.size(); ++k) {
      const double angle = std::numbers::pi / 3.0 * static_cast<double>(k);
      result[k] = {2.0 * p[4] * std::cos(angle), 2.0 * p[4] * std::sin(angle), 1.0 / 12.0};
    }
    return result;
  }
};

/// Terms of a polynomial in sx and sy without its constant: 5 of degree 2, 14 of degree 4.
constexpr int terms_of(int degree) { return (degree + 1) * (degree + 2) / 2 - 1; }

template <int degree, class Row>
void add_terms(double sx, double sy, double share, Row row) {
  std::array<double, degree + 1> power_x{1.0}, power_y{1.0};
  int term = 0;
  for (std::size_t k = 1; k <= degree; ++k) {
    power_x[k] = power_x[k - 1] * sx;
    power_y[k] = power_y[k - 1] * sy;
    for (std::size_t j = 0; j <= k; ++j) row[term++] += share * power_x[k - j] * power_y[j];
  }
}

template <int degree, class Exposure = Sharp>
class Fitter {
  static constexpr int unknowns = 4 + Exposure::parameters;
  using Parameters = typename Exposure::Values;
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

  /// From `p`, which follows.
  PressFit run(Parameters& p) {
    p = bounded(p);
    Changes residuals = residuals_at(p);
    double damping = 1e-3;
    for (int iteration = 0; iteration < kMaxFitIterations; ++iteration) {
      reweight(residuals);
      residuals = residuals_at(p);
      const Parameters step = improve(p, residuals, damping);
      if (step.cwiseAbs().maxCoeff() < kConvergedPx) break;
    }
    const double total = (weights_.asDiagonal() * changes_.cwiseAbs2()).sum();
    const double left = (weights_.asDiagonal() * residuals.cwiseAbs2()).sum();
    return {{p[0], p[1], p[2], p[3]}, robust_cost(residuals), total > 0.0 ? 1.0 - left / total : 0.0};
  }

 private:
  Parameters bounded(Parameters p) const {
    p[2] = std::clamp(p[2], 3.0, 0.98 * ball_px_);
    p[3] = std::clamp(p[3], 1.0, 60.0);
    return p;
  }

  void fill_features(const Parameters& p) {
    const double squared = ball_px_ * ball_px_;
    const double rim = 1.0 / std::sqrt(squared - p[2] * p[2]);  // slope over distance at the contact's rim
    const auto glimpses = Exposure::glimpses(p);
    features_.setZero();
    for (Eigen::Index k = 0; k < size_; ++k) {
      const auto point = static_cast<std::size_t>(k);
      for (const Glimpse& glimpse : glimpses) {
        const double x = points_.u_px[point] - p[0] - glimpse.u_px,
                     y = points_.v_px[point] - p[1] - glimpse.v_px;
        const double distance = std::sqrt(x * x + y * y);
        const double slope_over_distance = distance <= p[2]
                                               ? 1.0 / std::sqrt(squared - distance * distance)
                                               : rim * p[2] / distance * std::exp((p[2] - distance) / p[3]);
        add_terms<degree>(slope_over_distance * x, slope_over_distance * y, glimpse.share, features_.row(k));
      }
    }
  }

  /// What is left of the colors when the best color function of this shape's slopes is taken away.
  Changes residuals_at(const Parameters& p) {
    fill_features(p);
    const Features weighted = weights_.asDiagonal() * features_;
    Eigen::Matrix<double, features, features> information = weighted.transpose() * features_;
    information.diagonal().array() += 1e-9 * information.trace() + 1e-12;
    const Eigen::Matrix<double, features, 3> colors =
        information.ldlt().solve(weighted.transpose() * changes_);
    return changes_ - features_ * colors;
  }

  void reweight(const Changes& residuals) {
    weights_ = (1.0 + residuals.rowwise().squaredNorm().array() / (kLossScale * kLossScale)).rsqrt();
  }

  double robust_cost(const Changes& residuals) const {
    const auto squared = residuals.rowwise().squaredNorm().array() / (kLossScale * kLossScale);
    return ((1.0 + squared).sqrt() - 1.0).mean();
  }

  double weighted_cost(const Changes& residuals) const {
    return (weights_.array() * residuals.rowwise().squaredNorm().array()).sum();
  }

  /// One accepted step (or none); residuals and damping follow.
  Parameters improve(Parameters& p, Changes& residuals, double& damping) {
    std::array<Changes, unknowns> derivatives;
    for (int i = 0; i < unknowns; ++i) {
      Parameters moved = p;
      moved[i] += moved[i] + kFitStepPx > 0.98 * ball_px_ && i == 2 ? -kFitStepPx : kFitStepPx;
      derivatives[static_cast<std::size_t>(i)] = (residuals_at(moved) - residuals) / (moved[i] - p[i]);
    }
    Eigen::Matrix<double, unknowns, unknowns> information;
    Parameters right;
    for (int i = 0; i < unknowns; ++i) {
      const Changes weighted = weights_.asDiagonal() * derivatives[static_cast<std::size_t>(i)];
      right[i] = -weighted.cwiseProduct(residuals).sum();
      for (int j = 0; j <= i; ++j)
        information(i, j) = information(j, i) =
            weighted.cwiseProduct(derivatives[static_cast<std::size_t>(j)]).sum();
    }
    const double before = weighted_cost(residuals);
    for (int attempt = 0; attempt < 6; ++attempt) {
      Eigen::Matrix<double, unknowns, unknowns> damped = information;
      damped.diagonal() *= 1.0 + damping;
      damped.diagonal().array() += 1e-9;
      const Parameters step = damped.ldlt().solve(right);
      const Parameters next = bounded(p + step);
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

Sharp::Values values_of(const PressShape& shape) {
  return {shape.u_px, shape.v_px, shape.radius_px, shape.decay_px};
}

}  // namespace

PressFit fit_press(const PressPoints& points, const PressShape& start, double ball_px) {
  Sharp::Values p = values_of(start);
  return Fitter<2>(points, ball_px).run(p);
}

PressFit refine_press(const PressPoints& points, const PressShape& start, double ball_px) {
  Sharp::Values p = values_of(start);
  return Fitter<4>(points, ball_px).run(p);
}

double blurred_cost(const PressPoints& points, const PressShape& start, double ball_px) {
  Blurred::Values p;
  p << values_of(start), kFirstSmear * start.radius_px;
  return Fitter<2, Blurred>(points, ball_px).run(p).cost;
}

SlidPress fit_slid_press(const PressPoints& points, const PressShape& start, double ball_px) {
  SlidPress best;
  for (const bool across : {false, true}) {
    const double along = 2.0 * kFirstSmear * start.radius_px;
    Slid::Values p;
    p << values_of(start), across ? 0.0 : along, across ? along : 0.0;
    Fitter<2, Slid> fitter(points, ball_px);
    const PressFit fit = fitter.run(p);
    if (across && fit.cost >= best.cost) continue;
    best = {fit.shape.radius_px, p.tail<2>().norm(), fit.cost};
  }
  return best;
}

}  // namespace gelslam::calibration::detail
