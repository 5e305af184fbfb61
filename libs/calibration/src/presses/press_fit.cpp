// Fits the shape of a press to the color change of an image (not in the paper).
//
// At a point with the gel slope (gx, gy), the relative color change of each channel is modeled as a
// polynomial of (gx, gy) without constant term. The slope is that of a ball inside the radius; outside it
// continues from the value at the rim and decays exponentially. The unknowns are center, radius and decay
// length (and the movement of a sliding ball). The coefficients of the polynomial are linear and are
// eliminated for each shape (variable projection). The robust cost is minimized by iteratively reweighted
// least squares.

#include "presses/press_fit.hpp"

#include <ceres/jet.h>
#include <ceres/tiny_solver.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "judging/gel_change.hpp"

namespace gelslam::calibration::detail {

namespace {

// Fits the shape of a press to the color change of an image (not in the paper).
//
// At a point with the gel slope (gx, gy), the relative color change of each channel is modeled as a
// polynomial of (gx, gy) without constant term. The slope is that of a ball inside the radius; outside it
// continues from the value at the rim and decays exponentially. The unknowns are center, radius and decay
// length (and the movement of a sliding ball). The coefficients of the polynomial are linear and are
// eliminated for each shape (variable projection). The robust cost is minimized by iteratively reweighted
// least squares.
constexpr float kDarkLevels = 10.0F;  // keeps the relative change finite where there is no light
constexpr double kWindowRadii = 2.0, kWindowMarginPx = 10.0;

}  // namespace

cv::Mat3f relative_change(const cv::Mat3b& bgr, const cv::Mat3b& background) {
  cv::Mat3f relative, soft_background;
  cv::subtract(bgr, background, relative, cv::noArray(), CV_32F);
  relative -= median_color(relative);  // The median change of the whole image is a change of exposure.
  background.convertTo(soft_background, CV_32F);
  cv::GaussianBlur(soft_background, soft_background, cv::Size(), 1.0);
  cv::GaussianBlur(relative, relative, cv::Size(), 1.0);
  std::transform(relative.begin(), relative.end(), soft_background.begin(), relative.begin(),
                 [](const cv::Vec3f& c, const cv::Vec3f& b) {
                   return cv::Vec3f(c[0] / (b[0] + kDarkLevels), c[1] / (b[1] + kDarkLevels),
                                    c[2] / (b[2] + kDarkLevels));
                 });
  return relative;
}

PressPoints points_around(const ContactCircle& contact, const cv::Mat3f& relative, const CameraModel& camera,
                          double wanted) {
  const double reach = kWindowRadii * contact.radius_px + kWindowMarginPx;
  const cv::Point first(static_cast<int>(contact.u_px - reach), static_cast<int>(contact.v_px - reach)),
      last(static_cast<int>(contact.u_px + reach) + 2, static_cast<int>(contact.v_px + reach) + 2);
  const cv::Rect window = cv::Rect(first, last) & cv::Rect(0, 0, relative.cols, relative.rows);
  const int stride = std::max(1, static_cast<int>(std::lround(std::sqrt(window.area() / wanted))));
  PressPoints points;
  for (int v = window.y; v < window.y + window.height; v += stride)
    for (int u = window.x; u < window.x + window.width; u += stride) {
      const Eigen::Vector2d raw_px(u, v),
          px = camera.optics.has_lens() ? camera.rectified_px(raw_px) : raw_px;
      points.u_px.push_back(px.x());
      points.v_px.push_back(px.y());
      if (camera.optics.inverse_distance() > 0) {
        const Eigen::Vector2d rise = camera.to_mm(px) * camera.optics.inverse_distance();
        points.rise_x.push_back(rise.x());
        points.rise_y.push_back(rise.y());
      }
      for (int channel = 0; channel < 3; ++channel)
        points.change[static_cast<std::size_t>(channel)].push_back(
            static_cast<double>(relative(v, u)[channel]));
    }
  return points;
}
namespace {

constexpr double kLossScale = 0.05;  // Relative color change; the noise is about a third of it.
constexpr int kMaxReweightings = 10, kStepsPerWeighting = 4;
constexpr double kConvergedPx = 0.01;
constexpr double kFirstMove = 0.5;  // Relative to the radius: initial value of the movement.
constexpr double kMinFitRadiusPx = 3.0, kMaxFitRadiusOfBall = 0.98, kMinDecayPx = 1.0, kMaxDecayPx = 60.0;

/// Slope of the gel at (x, y) pixels from the ball's center: on the ball inside the radius, decaying
/// exponentially outside.
template <class T>
std::array<T, 2> gel_slope(const T& x, const T& y, double ball_px, const T& radius, const T& decay) {
  using std::exp, std::sqrt;
  const T squared = x * x + y * y;
  T over_distance;
  if (squared <= radius * radius) {
    over_distance = 1.0 / sqrt(ball_px * ball_px - squared);
  } else {
    const T distance = sqrt(squared), at_rim = radius / sqrt(ball_px * ball_px - radius * radius);
    over_distance = at_rim / distance * exp((radius - distance) / decay);
  }
  return {over_distance * x, over_distance * y};
}

/// Height of the gel at (x, y) above the rim, in pixels.
template <class T>
T height_over_rim(const T& x, const T& y, double ball_px, const T& radius, const T& decay) {
  using std::exp, std::sqrt;
  const T squared = x * x + y * y, down_at_rim = sqrt(ball_px * ball_px - radius * radius);
  if (squared <= radius * radius) return down_at_rim - sqrt(ball_px * ball_px - squared);
  return radius / down_at_rim * decay * (1.0 - exp((radius - sqrt(squared)) / decay));
}

/// Weighted color errors of a press, with the interface of ceres::TinySolver. If `moves` is true, the
/// movement of the ball in x and y is fitted in addition to center, radius and decay.
template <int degree, bool moves>
class PressErrors {
  // Number of terms of a polynomial in two variables without its constant.
  static constexpr int kTerms = (degree + 1) * (degree + 2) / 2 - 1, kParameters = moves ? 6 : 4;
  template <class T>
  using Terms = std::array<T, static_cast<std::size_t>(kTerms)>;
  using Colors = Eigen::Matrix<double, Eigen::Dynamic, 3>;

 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = kParameters };
  using Parameters = Eigen::Matrix<double, kParameters, 1>;

  PressErrors(const PressPoints& points, double ball_px)
      : points_(points),
        ball_px_(ball_px),
        root_weights_(Eigen::VectorXd::Ones(rows())),
        changes_(rows(), 3) {
    for (int c = 0; c < 3; ++c)
      changes_.col(c) = Eigen::VectorXd::Map(points.change[static_cast<std::size_t>(c)].data(), rows());
  }

  int NumResiduals() const { return static_cast<int>(3 * rows()); }

  bool operator()(const double* parameters, double* errors, double* jacobian) const {
    Eigen::Matrix<double, Eigen::Dynamic, kTerms> terms(rows(), kTerms);
    for (Eigen::Index k = 0; k < rows(); ++k)
      terms.row(k) = root_weights_[k] * Eigen::Matrix<double, 1, kTerms>(terms_at(k, parameters).data());
    // Dynamic size, because Eigen's code for each fixed size would take seconds to compile.
    Eigen::MatrixXd information = terms.transpose() * terms;
    information.diagonal().array() += 1e-9 * information.trace() + 1e-12;
    const Eigen::LDLT<Eigen::MatrixXd> solver(information);
    const Colors seen = root_weights_.asDiagonal() * changes_;
    const Eigen::Matrix<double, kTerms, 3> colors = solver.solve(Eigen::MatrixXd(terms.transpose() * seen));
    Colors::Map(errors, rows(), 3) = terms * colors - seen;
    if (jacobian == nullptr) return true;
    auto derivatives =
        Eigen::Matrix<double, Eigen::Dynamic, kParameters>::Map(jacobian, 3 * rows(), kParameters);
    fill_derivatives(parameters, colors, derivatives);
    // The coefficients of the color function change with the shape (Kaufman's approximation).
    for (int c = 0; c < 3; ++c) {
      auto channel = derivatives.middleRows(c * rows(), rows());
      channel -= terms * solver.solve(Eigen::MatrixXd(terms.transpose() * channel));
    }
    return true;
  }

  void reweight(const Parameters& parameters) {
    root_weights_ = (1.0 + scaled_squares(parameters)).sqrt().rsqrt();
  }
  double robust_cost(const Parameters& parameters) const {
    return ((1.0 + scaled_squares(parameters)).sqrt() - 1.0).mean();
  }
  /// Returns 1 - residual / total sum of squares, weighted.
  double explained(const Parameters& parameters) const {
    const double total = (root_weights_.asDiagonal() * changes_).squaredNorm() / (kLossScale * kLossScale);
    return total > 0.0 ? 1.0 - (root_weights_.array().square() * scaled_squares(parameters)).sum() / total
                       : 0.0;
  }

 private:
  Eigen::Index rows() const { return static_cast<Eigen::Index>(points_.u_px.size()); }

  /// Returns the unweighted squared errors of the points, in units of the loss's scale.
  Eigen::ArrayXd scaled_squares(const Parameters& parameters) const {
    Colors errors(rows(), 3);
    (*this)(parameters.data(), errors.data(), nullptr);
    return errors.rowwise().squaredNorm().array() /
           (kLossScale * kLossScale * root_weights_.array().square());
  }

  /// Computes the derivatives of the colors with respect to the parameters, for fixed coefficients.
  template <class Derivatives>
  void fill_derivatives(const double* parameters, const Eigen::Matrix<double, kTerms, 3>& colors,
                        Derivatives& derivatives) const {
    using Jet = ceres::Jet<double, kParameters>;
    std::array<Jet, kParameters> jets;
    for (std::size_t i = 0; i < jets.size(); ++i) jets[i] = Jet(parameters[i], static_cast<int>(i));
    for (Eigen::Index k = 0; k < rows(); ++k) {
      const Terms<Jet> terms = terms_at(k, jets.data());
      for (int c = 0; c < 3; ++c) {
        Parameters sum = Parameters::Zero();
        for (int t = 0; t < kTerms; ++t) sum += colors(t, c) * terms[static_cast<std::size_t>(t)].v;
        derivatives.row(c * rows() + k) = root_weights_[k] * sum.transpose();
      }
    }
  }

  template <class T>
  Terms<T> terms_at(Eigen::Index point, const T* parameters) const {
    const auto k = static_cast<std::size_t>(point);
    T x = points_.u_px[k] - parameters[0], y = points_.v_px[k] - parameters[1];
    const T radius = bounded(parameters[2], kMinFitRadiusPx, kMaxFitRadiusOfBall * ball_px_),
            decay = bounded(parameters[3], kMinDecayPx, kMaxDecayPx);
    if (!points_.rise_x.empty()) {
      const T height = height_over_rim<T>(x, y, ball_px_, radius, decay);
      x += points_.rise_x[k] * height;
      y += points_.rise_y[k] * height;
    }
    Terms<T> terms{};
    if constexpr (moves) {  // A moving ball appears blurred: the mean over five positions.
      for (const double part : {-0.4, -0.2, 0.0, 0.2, 0.4})
        add_terms(0.2,
                  gel_slope<T>(x - part * parameters[4], y - part * parameters[5], ball_px_, radius, decay),
                  terms);
    } else {
      add_terms(1.0, gel_slope<T>(x, y, ball_px_, radius, decay), terms);
    }
    return terms;
  }

  template <class T>
  static void add_terms(double share, const std::array<T, 2>& slope, Terms<T>& sum) {
    std::array<T, degree + 1> x, y;
    x[0] = T(share);
    y[0] = T(1.0);
    for (std::size_t n = 1; n <= degree; ++n) {
      x[n] = x[n - 1] * slope[0];
      y[n] = y[n - 1] * slope[1];
    }
    std::size_t term = 0;
    for (std::size_t n = 1; n <= degree; ++n)
      for (std::size_t j = 0; j <= n; ++j) sum[term++] += x[n - j] * y[j];
  }

  template <class T>
  static T bounded(const T& value, double low, double high) {
    return value < low ? T(low) : value > high ? T(high) : value;
  }

  const PressPoints& points_;
  double ball_px_;
  Eigen::VectorXd root_weights_;
  Colors changes_;
};

/// Fits from the values in `parameters` (those of PressShape, then the movement), which receive the result.
template <int degree, bool moves>
PressFit fit(const PressPoints& points, double ball_px,
             typename PressErrors<degree, moves>::Parameters& parameters) {
  PressErrors<degree, moves> errors(points, ball_px);
  ceres::TinySolver<PressErrors<degree, moves>> solver;
  solver.options.max_num_iterations = kStepsPerWeighting;
  solver.options.parameter_tolerance = kConvergedPx / parameters.norm();
  for (int round = 0; round < kMaxReweightings; ++round) {
    const auto before = parameters;
    errors.reweight(parameters);
    solver.Solve(errors, &parameters);
    parameters[2] = std::clamp(parameters[2], kMinFitRadiusPx, kMaxFitRadiusOfBall * ball_px);
    parameters[3] = std::clamp(parameters[3], kMinDecayPx, kMaxDecayPx);
    if ((parameters - before).cwiseAbs().maxCoeff() < kConvergedPx) break;
  }
  return {{parameters[0], parameters[1], parameters[2], parameters[3]},
          errors.robust_cost(parameters),
          errors.explained(parameters)};
}

Eigen::Vector4d values_of(const PressShape& shape) {
  return {shape.u_px, shape.v_px, shape.radius_px, shape.decay_px};
}

}  // namespace

PressFit fit_press(const PressPoints& points, const PressShape& start, double ball_px) {
  Eigen::Vector4d parameters = values_of(start);
  return fit<2, false>(points, ball_px, parameters);
}

PressFit refine_press(const PressPoints& points, const PressShape& start, double ball_px) {
  Eigen::Vector4d parameters = values_of(start);
  return fit<4, false>(points, ball_px, parameters);
}

SlidPress fit_slid_press(const PressPoints& points, const PressShape& start, double ball_px) {
  SlidPress best;
  for (const bool across : {false, true}) {
    const double move_px = kFirstMove * start.radius_px;
    Eigen::Vector<double, 6> parameters;
    parameters << values_of(start), across ? 0.0 : move_px, across ? move_px : 0.0;
    const PressFit found = fit<2, true>(points, ball_px, parameters);
    if (across && found.cost >= best.cost) continue;
    best = {found.shape.radius_px, parameters.tail<2>().norm(), found.cost};
  }
  return best;
}

}  // namespace gelslam::calibration::detail
