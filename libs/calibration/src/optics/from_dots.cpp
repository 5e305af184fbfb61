#include <ceres/ceres.h>

#include <algorithm>
#include <map>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "gelslam/calibration/optics_fit.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/sensor/sensor_profile.hpp"
#include "gelslam/surface/background.hpp"
#include "optics/optics_model.hpp"

namespace gelslam {
namespace {

using namespace calibration::detail;

constexpr std::size_t kMinDots = 20;
constexpr double kFirstDotSigmaPx = 0.4;  // of printed dots on four sensors
constexpr double kDotLossSigmas = 2;
const std::vector<int> kHidden = {4, 5, 6};  // distance and dome: one picture shows them in the lens alone

/// The middle of a dot: pixels count by how much darker they are than what is around it.
cv::Point2d middle_of_dot(const cv::Mat1f& brightness, const cv::Point2d& start, double diameter_px) {
  constexpr double kReach = 0.85, kInk = 0.35;  // of the diameter; of the light that ink takes at least
  cv::Point2d middle = start;
  for (int round = 0; round < 2; ++round) {
    const double reach = kReach * diameter_px;
    const cv::Rect box =
        cv::Rect(cv::Point(static_cast<int>(middle.x - reach), static_cast<int>(middle.y - reach)),
                 cv::Point(static_cast<int>(middle.x + reach) + 2, static_cast<int>(middle.y + reach) + 2)) &
        cv::Rect({}, brightness.size());
    std::vector<float> around;
    for (int v = box.y; v < box.br().y; ++v)
      for (int u = box.x; u < box.br().x; ++u)
        if (std::hypot(u - middle.x, v - middle.y) > 0.9 * reach) around.push_back(brightness(v, u));
    if (around.empty()) return middle;
    const double bare = static_cast<double>(quantile_in_place(around, 0.5));
    cv::Point2d sum;
    double weights = 0;
    for (int v = box.y; v < box.br().y; ++v)
      for (int u = box.x; u < box.br().x; ++u) {
        if (std::hypot(u - middle.x, v - middle.y) > reach) continue;
        const double darker = 1 - static_cast<double>(brightness(v, u)) / std::max(bare, 1.0);
        const double weight = std::clamp(darker / kInk - 0.2, 0.0, 1.0);
        sum += weight * cv::Point2d(u, v);
        weights += weight;
      }
    if (weights > 0) middle = sum / weights;
  }
  return middle;
}

struct GridDot {
  cv::Point2d px;
  int column = 0, row = 0;
};

/// Columns and rows by walking from dot to dot, from the one nearest to the picture's center.
std::vector<GridDot> number_dots(const std::vector<cv::Point2d>& dots, const cv::Size& picture) {
  const auto nearest = [&](const cv::Point2d& at) {
    return static_cast<std::size_t>(
        std::ranges::min_element(dots, {}, [&](const cv::Point2d& dot) { return cv::norm(dot - at); }) -
        dots.begin());
  };
  struct Step {
    cv::Point2d right, down;
  };
  const std::size_t first = nearest({0.5 * picture.width, 0.5 * picture.height});
  std::size_t neighbor = first;
  for (std::size_t k = 0; k < dots.size(); ++k)
    if (k != first &&
        (neighbor == first || cv::norm(dots[k] - dots[first]) < cv::norm(dots[neighbor] - dots[first])))
      neighbor = k;
  cv::Point2d right = dots[neighbor] - dots[first];
  while (right.x < std::abs(right.y)) right = {-right.y, right.x};  // the most horizontal of four
  std::map<std::size_t, std::pair<GridDot, Step>> found = {
      {first, {{dots[first], 0, 0}, {right, {-right.y, right.x}}}}};
  std::vector<std::size_t> open = {first};
  constexpr double kNear = 0.3;  // of the distance between dots
  for (std::size_t k = 0; k < open.size(); ++k) {
    const auto [dot, step] = found.at(open[k]);
    for (const int side : {-1, 1})
      for (const bool along : {true, false}) {
        const cv::Point2d move = along ? step.right : step.down;
        const std::size_t other = nearest(dot.px + side * move);
        const cv::Point2d made = side * (dots[other] - dot.px);
        if (cv::norm(made - move) > kNear * cv::norm(move) || found.contains(other)) continue;
        Step next = step;
        (along ? next.right : next.down) = made;
        found[other] = {{dots[other], dot.column + (along ? side : 0), dot.row + (along ? 0 : side)}, next};
        open.push_back(other);
      }
  }
  std::vector<GridDot> grid;
  for (const auto& entry : found) grid.push_back(entry.second.first);
  return grid;
}

/// A dot on the gel at rest, of a grid {x, y of its origin, x, y of a step to the right}, in mm.
struct DotError {
  GridDot dot;
  cv::Size picture;
  double pitch_mm, sigma_px;
  template <class T>
  bool operator()(const T* numbers, const T* grid, T* error) const {
    const OpticsModel<T> model{numbers, picture, pitch_mm};
    const double i = dot.column, j = dot.row;
    const Eigen::Matrix<T, 2, 1> xy(grid[0] + i * grid[2] - j * grid[3], grid[1] + i * grid[3] + j * grid[2]);
    const Eigen::Matrix<T, 3, 1> point(xy.x(), xy.y(), model.rest_height_mm(xy));
    const Eigen::Matrix<T, 2, 1> px = model.raw_px(model.project(point));
    error[0] = (px.x() - dot.px.x) / sigma_px;
    error[1] = (px.y() - dot.px.y) / sigma_px;
    return true;
  }
};

}  // namespace

OpticsFit optics_from_dots(const cv::Mat3b& picture, double pixel_pitch_mm, const SensorOptics& start) {
  const auto markers = find_marker_dots(picture);
  std::vector<cv::Point2d> dots;
  if (markers) {
    cv::Mat1f brightness(picture.size());
    std::ranges::transform(picture, brightness.begin(),
                           [](const cv::Vec3b& c) { return static_cast<float>(c[0] + c[1] + c[2]); });
    const cv::Rect2d whole(markers->diameter_px, markers->diameter_px,
                           picture.cols - 2 * markers->diameter_px, picture.rows - 2 * markers->diameter_px);
    for (const cv::Point2d& dot : markers->centers_px)
      if (whole.contains(dot)) dots.push_back(middle_of_dot(brightness, dot, markers->diameter_px));
  }
  const std::vector<GridDot> grid =
      dots.size() < kMinDots ? std::vector<GridDot>() : number_dots(dots, picture.size());
  if (grid.size() < kMinDots)
    throw Error("the picture shows no grid of printed dots (at least 20 are needed; found " +
                std::to_string(grid.size()) + ")");
  OpticsNumbers numbers = numbers_of(start);
  std::array<double, 4> place{};
  OpticsNumbers variance{};
  OpticsFit fit;
  double sigma_px = kFirstDotSigmaPx;
  const CameraModel camera{picture.size(), pixel_pitch_mm, start};
  for (const GridDot& dot : grid)
    if (dot.column == 0 && dot.row == 0) {
      const Eigen::Vector2d mm = camera.to_mm(camera.rest_px({dot.px.x, dot.px.y}));
      place = {mm.x(), mm.y(), markers->spacing_px * pixel_pitch_mm, 0};
    }
  for (int round = 0; round < 3; ++round) {
    ceres::Problem problem;
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<OpticsPrior, 7, 7>(new OpticsPrior{numbers_of(start)}), nullptr,
        numbers.data());
    for (const GridDot& dot : grid)
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<DotError, 2, 7, 4>(
                                   new DotError{dot, picture.size(), pixel_pitch_mm, sigma_px}),
                               new ceres::CauchyLoss(kDotLossSigmas), numbers.data(), place.data());
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.max_num_iterations = 100;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    problem.SetManifold(numbers.data(), new ceres::SubsetManifold(OpticsFit::kNumbers, kHidden));
    ceres::Solve(options, &problem, &summary);
    problem.SetManifold(numbers.data(), nullptr);  // the variance is that of all
    ceres::Covariance::Options covariance_options;
    covariance_options.algorithm_type = ceres::DENSE_SVD;
    ceres::Covariance covariance(covariance_options);
    std::array<double, 49> block{};
    if (!covariance.Compute(
            std::vector<std::pair<const double*, const double*>>{{numbers.data(), numbers.data()}},
            &problem) ||
        !covariance.GetCovarianceBlock(numbers.data(), numbers.data(), block.data()))
      throw Error("the dots do not lie on a grid");
    for (std::size_t k = 0; k < variance.size(); ++k) variance[k] = block[8 * k];
    double squares = 0;
    for (const GridDot& dot : grid) {
      std::array<double, 2> error{};
      DotError{dot, picture.size(), pixel_pitch_mm, 1}(numbers.data(), place.data(), error.data());
      squares += error[0] * error[0] + error[1] * error[1];
    }
    fit.residual = std::sqrt(squares / static_cast<double>(2 * grid.size()));
    sigma_px = std::max(fit.residual, 0.05);
  }
  fit.measurements = grid.size();
  conclude(numbers, variance, start, fit);
  // Only a dome and a near camera together bend the grid: where the start has neither, no derivative shows
  // how much of the lens is theirs. What those of a usual sensor would change counts as doubt.
  SensorOptics domed = start;
  if (start.camera_distance_mm == 0) domed.camera_distance_mm = kGelSightMiniOptics.camera_distance_mm;
  if (start.gel_dome_per_mm == std::array{0.0, 0.0})
    domed.gel_dome_per_mm = kGelSightMiniOptics.gel_dome_per_mm;
  if (domed == start) return fit;
  const OpticsFit other = optics_from_dots(picture, pixel_pitch_mm, domed);
  const OpticsNumbers here = numbers_of(fit.optics), there = numbers_of(other.optics);
  for (std::size_t k = 0; k < here.size(); ++k)
    if (fit.shown[k]) fit.sigma[k] = std::hypot(other.sigma[k], here[k] - there[k]);
  return fit;
}

}  // namespace gelslam
