#include "presses/press_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace gelslam::calibration::detail {
namespace {

constexpr double kLossScale = 0.05;  // relative color change; noise is a third of it
constexpr int kMaxFitIterations = 25;
constexpr double kConvergedPx = 0.01;
constexpr double kFirstSmear = 0.25;  // of the radius: where the search for blur and movement starts

using Change = Eigen::Vector3d;               // of B, G, R
using Solver = Eigen::LDLT<Eigen::MatrixXd>;  // of any size: each fixed one would compile for seconds

/// A place from which a picture was also taken, as offsets per unit of the exposure's parameters, and how
/// much it counts.
template <int parameters>
struct Glimpse {
  double share = 1.0;
  Eigen::Matrix<double, 2, parameters> offsets;
};

/// One picture, taken at once.
struct Sharp {
  static constexpr int kParameters = 0;
  static std::array<Glimpse<0>, 1> glimpses() { return {}; }
};

/// The ball moved along the two parameters while the picture was taken.
struct Slid {
  static constexpr int kParameters = 2;
  static std::array<Glimpse<2>, 5> glimpses() {
    std::array<Glimpse<2>, 5> result;
    for (std::size_t k = 0; k < result.size(); ++k)
      result[k] = {0.2, (0.2 * static_cast<double>(k) - 0.4) * Eigen::Matrix2d::Identity()};
    return result;
  }
};

/// Blurred by a Gaussian of this many pixels: Radon's seven points.
struct Blurred {
  static constexpr int kParameters = 1;
  static std::array<Glimpse<1>, 7> glimpses() {
    std::array<Glimpse<1>, 7> result;
    result[0] = {0.5, Eigen::Vector2d::Zero()};
    for (std::size_t k = 1; k < result.size(); ++k) {
      const double angle = std::numbers::pi / 3.0 * static_cast<double>(k);
      result[k] = {1.0 / 12.0, 2.0 * Eigen::Vector2d(std::cos(angle), std::sin(angle))};
    }
    return result;
  }
};

/// Slope of the gel on and around a ball, as a function of the place relative to the ball's center.
class Gel {
 public:
  Gel(double ball_px, double radius_px, double decay_px)
      : squared_(ball_px * ball_px),
        radius_(radius_px),
        decay_(decay_px),
        rim_(1.0 / std::sqrt(squared_ - radius_px * radius_px)) {}

  Eigen::Vector2d slope(const Eigen::Vector2d& place) const {
    return slope_over_distance(place.norm()) * place;
  }

  /// The slope and its derivatives by place (columns 0 and 1), radius and decay.
  Eigen::Vector2d slope(const Eigen::Vector2d& place, Eigen::Matrix<double, 2, 4>& derivatives) const {
    const double distance = place.norm(), ratio = slope_over_distance(distance);
    const bool on_ball = distance <= radius_;
    const double bend = on_ball ? ratio * ratio * ratio : -ratio * (1.0 / distance + 1.0 / decay_) / distance;
    derivatives.leftCols<2>() = bend * place * place.transpose();
    derivatives.leftCols<2>().diagonal().array() += ratio;
    const double by_radius = on_ball ? 0.0 : ratio * (radius_ * rim_ * rim_ + 1.0 / radius_ + 1.0 / decay_),
                 by_decay = on_ball ? 0.0 : ratio * (distance - radius_) / (decay_ * decay_);
    derivatives.col(2) = by_radius * place;
    derivatives.col(3) = by_decay * place;
    return ratio * place;
  }

 private:
  double slope_over_distance(double distance) const {
    return distance <= radius_ ? 1.0 / std::sqrt(squared_ - distance * distance)
                               : rim_ * radius_ / distance * std::exp((radius_ - distance) / decay_);
  }

  double squared_, radius_, decay_, rim_;
};

/// Terms of a polynomial in the slope without its constant: 5 of degree 2, 14 of degree 4.
constexpr int terms_of(int degree) { return (degree + 1) * (degree + 2) / 2 - 1; }

template <int degree>
struct Powers {
  explicit Powers(const Eigen::Vector2d& slope) {
    for (std::size_t k = 1; k <= degree; ++k) {
      x[k] = x[k - 1] * slope.x();
      y[k] = y[k - 1] * slope.y();
    }
  }
  /// Calls visit(exponent of x, exponent of y) for each term in turn.
  template <class Visit>
  static void for_terms(const Visit& visit) {
    for (std::size_t k = 1; k <= degree; ++k)
      for (std::size_t j = 0; j <= k; ++j) visit(k - j, j);
  }
  std::array<double, degree + 1> x{1.0}, y{1.0};
};

template <int degree, class Exposure = Sharp>
class Fitter {
  static constexpr int kUnknowns = 4 + Exposure::kParameters, kFeatures = terms_of(degree);
  using Features = Eigen::Matrix<double, kFeatures, 1>;
  using Residuals = std::vector<Change>;
  using Information = Eigen::Matrix<double, kUnknowns, kUnknowns>;

 public:
  using Parameters = Eigen::Matrix<double, kUnknowns, 1>;  ///< center, radius, decay, exposure

  Fitter(const PressPoints& points, double ball_px)
      : points_(points), ball_px_(ball_px), features_(points.u_px.size()), weights_(features_.size(), 1.0) {
    for (std::size_t k = 0; k < features_.size(); ++k)
      changes_.emplace_back(points.change[0][k], points.change[1][k], points.change[2][k]);
  }

  /// From `p`, which follows.
  PressFit run(Parameters& p) {
    p = bounded(p);
    fill_features(p);
    Residuals residuals = solve();
    double damping = 1e-3;
    for (int iteration = 0; iteration < kMaxFitIterations; ++iteration) {
      reweight(residuals);
      residuals = solve();
      const Parameters step = improve(p, residuals, damping);
      if (step.cwiseAbs().maxCoeff() < kConvergedPx) break;
    }
    const double total = weighted_cost(changes_), left = weighted_cost(residuals);
    return {{p[0], p[1], p[2], p[3]}, robust_cost(residuals), total > 0.0 ? 1.0 - left / total : 0.0};
  }

 private:
  Parameters bounded(Parameters p) const {
    p[2] = std::clamp(p[2], 3.0, 0.98 * ball_px_);
    p[3] = std::clamp(p[3], 1.0, 60.0);
    return p;
  }

  template <class G>
  Eigen::Vector2d place(std::size_t point, const Parameters& p, const G& glimpse) const {
    return Eigen::Vector2d(points_.u_px[point], points_.v_px[point]) - p.template head<2>() -
           glimpse.offsets * p.template tail<Exposure::kParameters>();
  }

  void fill_features(const Parameters& p) {
    const Gel gel(ball_px_, p[2], p[3]);
    for (std::size_t k = 0; k < features_.size(); ++k) {
      features_[k].setZero();
      for (const auto& glimpse : glimpses_) {
        const Powers<degree> powers(gel.slope(place(k, p, glimpse)));
        int term = 0;
        powers.for_terms([&](std::size_t i, std::size_t j) {
          features_[k][term++] += glimpse.share * powers.x[i] * powers.y[j];
        });
      }
    }
  }

  /// What is left of the colors when the best color function of the features is taken away.
  Residuals solve() {
    Eigen::Matrix<double, kFeatures, kFeatures> information =
        Eigen::Matrix<double, kFeatures, kFeatures>::Zero();
    Eigen::Matrix<double, kFeatures, 3> right = Eigen::Matrix<double, kFeatures, 3>::Zero();
    for (std::size_t k = 0; k < features_.size(); ++k) {
      const Features weighted = weights_[k] * features_[k];
      for (int term = 0; term < kFeatures; ++term) information.col(term) += weighted[term] * features_[k];
      for (int channel = 0; channel < 3; ++channel) right.col(channel) += changes_[k][channel] * weighted;
    }
    information.diagonal().array() += 1e-9 * information.trace() + 1e-12;
    solver_.compute(information);
    colors_ = solver_.solve(Eigen::MatrixXd(right)).transpose();
    Residuals residuals(features_.size());
    for (std::size_t k = 0; k < residuals.size(); ++k)
      residuals[k].noalias() = changes_[k] - colors_ * features_[k];
    return residuals;
  }

  void reweight(const Residuals& residuals) {
    for (std::size_t k = 0; k < residuals.size(); ++k)
      weights_[k] = 1.0 / std::sqrt(1.0 + residuals[k].squaredNorm() / (kLossScale * kLossScale));
  }

  double robust_cost(const Residuals& residuals) const {
    double sum = 0.0;
    for (const Change& residual : residuals)
      sum += std::sqrt(1.0 + residual.squaredNorm() / (kLossScale * kLossScale)) - 1.0;
    return sum / static_cast<double>(residuals.size());
  }

  double weighted_cost(const Residuals& residuals) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < residuals.size(); ++k) sum += weights_[k] * residuals[k].squaredNorm();
    return sum;
  }

  /// Derivatives of the color at a point by all unknowns, for fixed color functions.
  Eigen::Matrix<double, 3, kUnknowns> color_derivatives(std::size_t point, const Parameters& p,
                                                        const Gel& gel) const {
    Eigen::Matrix<double, 3, kUnknowns> result = Eigen::Matrix<double, 3, kUnknowns>::Zero();
    for (const auto& glimpse : glimpses_) {
      Eigen::Matrix<double, 2, 4> by_shape;
      const Powers<degree> powers(gel.slope(place(point, p, glimpse), by_shape));
      Eigen::Matrix<double, 3, 2> by_slope = Eigen::Matrix<double, 3, 2>::Zero();
      int term = 0;
      powers.for_terms([&](std::size_t i, std::size_t j) {
        if (i > 0)
          by_slope.col(0) += static_cast<double>(i) * powers.x[i - 1] * powers.y[j] * colors_.col(term);
        if (j > 0)
          by_slope.col(1) += static_cast<double>(j) * powers.x[i] * powers.y[j - 1] * colors_.col(term);
        ++term;
      });
      const Eigen::Matrix<double, 3, 4> colors = glimpse.share * by_slope * by_shape;
      result.template leftCols<2>() -= colors.template leftCols<2>();
      result.template middleCols<2>(2) += colors.template rightCols<2>();
      result.template rightCols<Exposure::kParameters>() -= colors.template leftCols<2>() * glimpse.offsets;
    }
    return result;
  }

  /// Normal equations of the unknowns. The color functions follow: what they can explain of the derivatives
  /// is taken away (Kaufman 1975).
  std::pair<Information, Parameters> normal_equations(const Parameters& p, const Residuals& residuals) const {
    Information information = Information::Zero();
    Parameters right = Parameters::Zero();
    Eigen::Matrix<double, 3 * kUnknowns, kFeatures> explained =
        Eigen::Matrix<double, 3 * kUnknowns, kFeatures>::Zero();
    const Gel gel(ball_px_, p[2], p[3]);
    for (std::size_t k = 0; k < residuals.size(); ++k) {
      const Eigen::Matrix<double, 3, kUnknowns> derivatives = color_derivatives(k, p, gel);
      const Eigen::Matrix<double, 3, kUnknowns> weighted = weights_[k] * derivatives;
      information.noalias() += weighted.transpose() * derivatives;
      right.noalias() += weighted.transpose() * residuals[k];
      for (int term = 0; term < kFeatures; ++term)
        explained.col(term) += features_[k][term] * weighted.reshaped();
    }
    const Eigen::Matrix<double, kFeatures, 3 * kUnknowns> followed =
        solver_.solve(Eigen::MatrixXd(explained.transpose()));
    for (int i = 0; i < kUnknowns; ++i)
      for (int j = 0; j < kUnknowns; ++j)
        information(i, j) -= explained.template middleRows<3>(3 * i)
                                 .transpose()
                                 .cwiseProduct(followed.template middleCols<3>(3 * j))
                                 .sum();
    return {information, right};
  }

  /// One accepted step (or none); features, residuals and damping follow.
  Parameters improve(Parameters& p, Residuals& residuals, double& damping) {
    const auto [information, right] = normal_equations(p, residuals);
    const double before = weighted_cost(residuals);
    for (int attempt = 0; attempt < 6; ++attempt) {
      Information damped = information;
      damped.diagonal() *= 1.0 + damping;
      damped.diagonal().array() += 1e-9;
      const Parameters step = Solver(damped).solve(Eigen::MatrixXd(right));
      const Parameters next = bounded(p + step);
      fill_features(next);
      Residuals there = solve();
      if (step.allFinite() && weighted_cost(there) <= before) {
        const Parameters done = next - p;
        p = next;
        residuals = std::move(there);
        damping = std::max(1e-6, damping * 0.3);
        return done;
      }
      damping *= 5.0;
    }
    return Parameters::Zero();
  }

  const PressPoints& points_;
  double ball_px_;
  const decltype(Exposure::glimpses()) glimpses_ = Exposure::glimpses();
  std::vector<Features> features_;
  std::vector<Change> changes_;
  std::vector<double> weights_;
  Solver solver_;
  Eigen::Matrix<double, 3, kFeatures> colors_;
};

Eigen::Vector4d values_of(const PressShape& shape) {
  return {shape.u_px, shape.v_px, shape.radius_px, shape.decay_px};
}

}  // namespace

PressFit fit_press(const PressPoints& points, const PressShape& start, double ball_px) {
  Eigen::Vector4d p = values_of(start);
  return Fitter<2>(points, ball_px).run(p);
}

PressFit refine_press(const PressPoints& points, const PressShape& start, double ball_px) {
  Eigen::Vector4d p = values_of(start);
  return Fitter<4>(points, ball_px).run(p);
}

double blurred_cost(const PressPoints& points, const PressShape& start, double ball_px) {
  Fitter<2, Blurred>::Parameters p;
  p << values_of(start), kFirstSmear * start.radius_px;
  return Fitter<2, Blurred>(points, ball_px).run(p).cost;
}

SlidPress fit_slid_press(const PressPoints& points, const PressShape& start, double ball_px) {
  SlidPress best;
  for (const bool across : {false, true}) {
    const double along = 2.0 * kFirstSmear * start.radius_px;
    Fitter<2, Slid>::Parameters p;
    p << values_of(start), across ? 0.0 : along, across ? along : 0.0;
    Fitter<2, Slid> fitter(points, ball_px);
    const PressFit fit = fitter.run(p);
    if (across && fit.cost >= best.cost) continue;
    best = {fit.shape.radius_px, p.tail<2>().norm(), fit.cost};
  }
  return best;
}

}  // namespace gelslam::calibration::detail
