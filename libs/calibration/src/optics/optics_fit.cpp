// Estimates the seven numbers of a sensor's optics from a scan (not in the papers; docs/algorithms.md,
// Optics).
//
// The object is rigid, so where two frames show the same place in different parts of the image, their
// surfaces must agree there. Wrong optics make the same place look different. The unknowns are the poses of
// all frames and the optics; the first frame is held fixed. For about 80 points of each pair of overlapping
// frames, the residuals are the difference of the two normals (two angles) and, with a small weight, of the
// two heights. What the gradient model has read (slopes and heights relative to the gel at rest, as maps over
// the image) is kept; for each trial value of the optics, the points of both frames are computed anew from
// these maps. Ceres minimizes the sum with a Cauchy loss. Variances come from a sandwich estimate over
// kStretches sections of the log.
//
// Limitation: errors of the gradient model that are the same over the whole log are not in that estimate;
// kCommonToAll and kDistanceError allow for them.

#include "gelslam/calibration/optics_fit.hpp"

#include <ceres/ceres.h>
#include <ceres/cubic_interpolation.h>
#include <ceres/normal_prior.h>
#include <ceres/rotation.h>
#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/error.hpp"
#include "gelslam/surface/contact_overlap.hpp"

namespace gelslam {
namespace {

constexpr std::array<const char*, OpticsFit::kNumbers> kNames = {
    "lens_k1",           "lens_center_px x", "lens_center_px y", "pixel_aspect", "camera_distance_mm",
    "gel_dome_per_mm x", "gel_dome_per_mm y"};

std::array<double, OpticsFit::kNumbers> values_of(const SensorOptics& o) {
  return {o.lens_k1,           o.lens_center_px[0],  o.lens_center_px[1],
          o.pixel_aspect,      o.camera_distance_mm, o.gel_dome_per_mm[0],
          o.gel_dome_per_mm[1]};
}

/// The unknowns of a fit: those of OpticsFit, with 1/distance in place of the distance.
using OpticsNumbers = std::array<double, OpticsFit::kNumbers>;

OpticsNumbers numbers_of(const SensorOptics& optics) {
  OpticsNumbers numbers = values_of(optics);
  numbers[4] = optics.inverse_distance();
  return numbers;
}

/// Standard deviations of the numbers among sensors of this kind, known before any data.
constexpr OpticsNumbers kPriorSigma = {0.05, 6.0, 6.0, 0.03, 0.02, 0.0015, 0.0015};

constexpr std::size_t kMinPairs = 10, kPairsPerFrame = 10, kPointsPerPair = 80;
constexpr double kMinShared = 0.3;    // Fraction of the smaller contact that both frames show.
constexpr double kMinMotionMm = 0.7;  // Smaller motions tell less than the noise.
constexpr double kNormalSigmaRad = 0.05;
// Scale of the Cauchy loss. Beside a steep flank the gel looks like a part of the object; such normals are
// far off and would bend the estimated dome.
constexpr double kLossRad = 0.015;
// Heights are needed only to determine z. Beside a contact without bare gel they are less accurate than
// normals.
constexpr double kHeightSigmaMm = 1;
// Neighboring pixels have correlated errors, so that this many points count as one.
constexpr double kCommonError = 15;
// Number of sections of a log whose errors are taken as independent.
constexpr std::size_t kStretches = 12;
// Errors of the color model, however, are the same in all sections. With this factor on the standard
// deviations, the errors on rendered logs of four sensors are 1.2 standard deviations (root mean square over
// the numbers other than the distance).
constexpr double kCommonToAll = 4;
// Relative standard deviation added to that of the distance. On these logs the estimated distances are 5 to
// 14 % off, mostly too large; with exact surfaces they are not.
constexpr double kDistanceError = 0.1;

SensorOptics optics_of(const double* numbers) {
  constexpr double kMin = 1e-6;  // 1/mm, a distance of one kilometer.
  return {numbers[0],
          {numbers[1], numbers[2]},
          numbers[3],
          numbers[4] > kMin ? 1 / numbers[4] : 0,
          {numbers[5], numbers[6]}};
}

using Grid = ceres::Grid2D<float, 3>;
using Interpolator = ceres::BiCubicInterpolator<Grid>;

/// What the gradient model has read of a frame, which does not depend on the optics: slopes relative to the
/// gel at rest, and relief (CameraModel::relief_mm()). The maps are on the rectified grid of the optics with
/// which the surface was computed.
struct ReadFrame {
  explicit ReadFrame(const SeenFrame& frame)
      : camera(frame.surface->camera()),
        maps(camera.size),
        contact(frame.surface->contact),
        confidence(frame.surface->confidence),
        points_mm(coarse_contact_points_mm(*frame.surface)),
        world_T_frame(frame.world_T_frame) {
    for (int v = 0; v < maps.rows; ++v)
      for (int u = 0; u < maps.cols; ++u) {
        const Eigen::Vector3d rest = camera.rest_point_mm(camera.to_mm(cv::Point(u, v)));
        const Eigen::Vector2d slope = camera.rest_slope(rest.head<2>());
        const cv::Vec3f& n = frame.surface->normals(v, u);
        const double height = static_cast<double>(frame.surface->height_mm(v, u));
        maps(v, u) = {static_cast<float>(-n[0] / n[2] - slope.x()),
                      static_cast<float>(-n[1] / n[2] - slope.y()),
                      static_cast<float>(camera.relief_mm(height) - camera.relief_mm(rest.z()))};
      }
    constexpr int kBorderPx = 3;  // At the border of a contact the gel leaves the object.
    cv::erode(contact, inner, cv::Mat(), cv::Point(-1, -1), kBorderPx, cv::BORDER_CONSTANT, 0);
  }

  CameraModel camera;
  cv::Mat3f maps;
  cv::Mat1b contact, confidence, inner;
  std::vector<Eigen::Vector3d> points_mm;
  Pose world_T_frame;
  Grid grid{maps.ptr<float>(), 0, maps.rows, 0, maps.cols};
  Interpolator map{grid};
};

struct Pair {
  std::size_t from = 0, to = 0;
  double motion_mm = 0;
};

/// Returns pairs of overlapping frames: for each frame, about kPairsPerFrame of them over the whole range of
/// motions, including the largest.
std::vector<Pair> overlapping_pairs(const std::vector<std::unique_ptr<ReadFrame>>& frames,
                                    const std::vector<SeenFrame>& seen) {
  std::vector<Pair> pairs;
  for (std::size_t to = 1; to < frames.size(); ++to) {
    std::vector<Pair> candidates;
    for (std::size_t from = 0; from < to; ++from) {
      const Pose from_T_to = frames[from]->world_T_frame.inverse() * frames[to]->world_T_frame;
      // A rotation counts with half the width of a contact.
      const double motion_mm = from_T_to.translation().norm() + 5 * rotation_angle_rad(from_T_to);
      if (motion_mm < kMinMotionMm) continue;
      if (shown_share(frames[to]->points_mm, *seen[from].surface, from_T_to) >= kMinShared)
        candidates.push_back({from, to, motion_mm});
    }
    std::ranges::stable_sort(candidates, std::greater<>(), &Pair::motion_mm);
    const std::size_t every = std::max<std::size_t>(1, candidates.size() / kPairsPerFrame);
    for (std::size_t k = 0; k < candidates.size(); k += every) pairs.push_back(candidates[k]);
  }
  return pairs;
}

/// Residual of a point: normal and height of one frame's surface, compared with those of the other frame at
/// the same place.
struct OverlapError {
  const ReadFrame *from, *to;
  Pose to_T_from;  // Motion before the fit.
  Eigen::Vector2d raw_px;
  Eigen::Vector3d read;  // Slopes and relief at the point.
  double weight;

  bool operator()(const double* from_step, const double* to_step, const double* numbers,
                  double* error) const {
    using Eigen::Vector2d, Eigen::Vector3d;
    const CameraModel camera{from->camera.size, from->camera.pitch_mm, optics_of(numbers)};
    const Vector2d rest_mm = camera.to_mm(camera.rectified_px(raw_px));
    const Vector3d gel = camera.rest_point_mm(rest_mm);
    const Vector3d point = camera.point_mm(rest_mm, camera.height_mm(camera.relief_mm(gel.z()) + read.z()));
    const Vector3d normal = normal_of(camera, gel, read.x(), read.y());

    Vector3d moved, turned, there, facing;
    ceres::AngleAxisRotatePoint(from_step, point.data(), moved.data());
    ceres::AngleAxisRotatePoint(from_step, normal.data(), turned.data());
    moved = to_T_from * (moved + Eigen::Map<const Vector3d>(from_step + 3)) -
            Eigen::Map<const Vector3d>(to_step + 3);
    turned = to_T_from.linear() * turned;
    const double back[3] = {-to_step[0], -to_step[1], -to_step[2]};
    ceres::AngleAxisRotatePoint(back, moved.data(), there.data());
    ceres::AngleAxisRotatePoint(back, turned.data(), facing.data());

    const Vector2d rest_there = camera.project(there);
    const auto raw_there = camera.raw_px(camera.to_px(rest_there));
    if (!raw_there) return false;
    const Vector2d at = to->camera.rectified_px(*raw_there);
    double values[3];
    to->map.Evaluate(at.y(), at.x(), values);
    const Vector3d gel_there = camera.rest_point_mm(rest_there);
    const Vector3d expected = normal_of(camera, gel_there, values[0], values[1]);
    const double height = camera.height_mm(camera.relief_mm(gel_there.z()) + values[2]);
    const double root = weight / std::sqrt(kCommonError);
    for (int k = 0; k < 2; ++k)
      error[k] = root / kNormalSigmaRad *
                 (std::atan(facing[k] / facing.z()) - std::atan(expected[k] / expected.z()));
    error[2] = root / kHeightSigmaMm * (there.z() - height) * expected.z();
    return true;
  }

 private:
  static Eigen::Vector3d normal_of(const CameraModel& camera, const Eigen::Vector3d& gel, double gx,
                                   double gy) {
    const Eigen::Vector2d slope = camera.rest_slope(gel.head<2>());
    return Eigen::Vector3d(-gx - slope.x(), -gy - slope.y(), 1).normalized();
  }
};

using OverlapCost = ceres::NumericDiffCostFunction<OverlapError, ceres::CENTRAL, 3, 6, 6, 7>;

/// The least-squares problem over poses and optics.
class Adjustment {
 public:
  Adjustment(const std::vector<SeenFrame>& seen, const SensorOptics& prior) {
    for (const SeenFrame& frame : seen) frames_.push_back(std::make_unique<ReadFrame>(frame));
    steps_.assign(frames_.size(), {});
    numbers_ = numbers_of(seen.front().surface->optics);
    using Vector = Eigen::Matrix<double, 7, 1>;
    const OpticsNumbers start = numbers_of(prior);
    prior_block_ = problem_.AddResidualBlock(
        new ceres::NormalPrior(Vector(kPriorSigma.data()).cwiseInverse().asDiagonal().toDenseMatrix(),
                               Vector(start.data())),
        nullptr, numbers_.data());
    for (const Pair& pair : overlapping_pairs(frames_, seen)) add(pair, seen);
    if (pairs_ < kMinPairs)
      throw Error("only " + std::to_string(pairs_) +
                  " pairs of frames show the same place in different parts of the picture: slide a textured "
                  "thing over the whole gel, back and forth, for about twenty seconds");
    if (problem_.HasParameterBlock(steps_[first_].data()))
      problem_.SetParameterBlockConstant(steps_[first_].data());
  }

  void solve() {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.max_num_iterations = 15;
    options.function_tolerance = 1e-5;
    // One thread adds in a fixed order, so that the result is the same every time.
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    if (!summary.IsSolutionUsable()) throw Error("the frames do not fit each other: no optics were found");
  }

  const OpticsNumbers& numbers() const { return numbers_; }
  std::size_t pairs() const { return pairs_; }

  /// Returns the variances by a sandwich estimate. `rmse_rad` receives the root mean square residual of the
  /// normals.
  OpticsNumbers variance(double& rmse_rad);

 private:
  /// Returns the root of the weight of the difference of two normals.
  static double weight_of(const ReadFrame& from, cv::Point pixel, const ReadFrame& to, cv::Point other) {
    if (from.confidence.empty() || to.confidence.empty()) return 1;
    constexpr float kBest = 255;
    return std::sqrt(shared_confidence(static_cast<float>(std::max<int>(1, from.confidence(pixel))) / kBest,
                                       static_cast<float>(std::max<int>(1, to.confidence(other))) / kBest));
  }

  void add(const Pair& pair, const std::vector<SeenFrame>& seen) {
    // The two frames take turns, so that the noise of one side does not always enter in the same way.
    const bool swapped = (pair.from + pair.to) % 2 == 1;
    const std::size_t a = swapped ? pair.to : pair.from, b = swapped ? pair.from : pair.to;
    const ReadFrame &from = *frames_[a], &to = *frames_[b];
    const Pose to_T_from = to.world_T_frame.inverse() * from.world_T_frame;
    std::vector<std::pair<cv::Point, double>> shared;  // Pixels and their weights.
    for (int v = 0; v < from.inner.rows; v += 2)
      for (int u = 0; u < from.inner.cols; u += 2) {
        if (from.inner(v, u) == 0) continue;
        const auto pixel = to.camera.pixel_at(to_T_from * seen[a].surface->point_mm({u, v}));
        if (pixel && to.inner(*pixel) != 0)
          shared.emplace_back(cv::Point(u, v), weight_of(from, {u, v}, to, *pixel));
      }
    if (shared.size() < kPointsPerPair) return;
    ++pairs_;
    for (std::size_t k = 0; k < kPointsPerPair; ++k) {
      const auto& [pixel, weight] = shared[k * shared.size() / kPointsPerPair];
      const cv::Vec3f& read = from.maps(pixel);
      const auto raw = from.camera.raw_px(Eigen::Vector2d(pixel.x, pixel.y));
      if (!raw) continue;
      blocks_.push_back(problem_.AddResidualBlock(
          new OverlapCost(
              new OverlapError{&from, &to, to_T_from, *raw,
                               Eigen::Vector3d(static_cast<double>(read[0]), static_cast<double>(read[1]),
                                               static_cast<double>(read[2])),
                               weight}),
          new ceres::CauchyLoss(kLossRad / kNormalSigmaRad / std::sqrt(kCommonError)), steps_[a].data(),
          steps_[b].data(), numbers_.data()));
      block_frame_.push_back(pair.to);
    }
    first_ = std::min(first_, std::min(a, b));
  }

  std::vector<std::unique_ptr<ReadFrame>> frames_;
  std::vector<std::array<double, 6>> steps_;
  OpticsNumbers numbers_{};
  ceres::Problem problem_;
  ceres::ResidualBlockId prior_block_ = nullptr;
  std::vector<ceres::ResidualBlockId> blocks_;
  std::vector<std::size_t> block_frame_;
  std::size_t pairs_ = 0, first_ = static_cast<std::size_t>(-1);
};

OpticsNumbers Adjustment::variance(double& rmse_rad) {
  ceres::Problem::EvaluateOptions options;
  options.residual_blocks = blocks_;
  options.residual_blocks.push_back(prior_block_);
  options.parameter_blocks = {numbers_.data()};
  for (std::size_t k = 0; k < steps_.size(); ++k)
    if (k != first_ && problem_.HasParameterBlock(steps_[k].data()))
      options.parameter_blocks.push_back(steps_[k].data());
  std::vector<double> residuals;
  ceres::CRSMatrix jacobian;
  problem_.Evaluate(options, nullptr, &residuals, nullptr, &jacobian);
  const Eigen::Index count = jacobian.num_cols;
  const Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>> rows(
      jacobian.num_rows, count, static_cast<Eigen::Index>(jacobian.values.size()), jacobian.rows.data(),
      jacobian.cols.data(), jacobian.values.data());
  Eigen::MatrixXd information(rows.transpose() * rows);
  Eigen::MatrixXd pulls = Eigen::MatrixXd::Zero(count, kStretches);
  double squares = 0;
  for (std::size_t row = 0; row < 3 * blocks_.size(); ++row) {
    if (row % 3 < 2) squares += residuals[row] * residuals[row];
    pulls.col(static_cast<Eigen::Index>(block_frame_[row / 3] * kStretches / frames_.size())) +=
        residuals[row] * rows.row(static_cast<Eigen::Index>(row)).transpose();
  }
  rmse_rad = kNormalSigmaRad * std::sqrt(kCommonError * squares /
                                         static_cast<double>(2 * std::max<std::size_t>(1, blocks_.size())));
  information.diagonal().array() += 1e-9;
  constexpr Eigen::Index kNumbers = OpticsFit::kNumbers;
  const Eigen::MatrixXd by_pull =
      information.ldlt().solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(count, kNumbers)));
  constexpr double kOfFew = static_cast<double>(kStretches) / (kStretches - 1);
  OpticsNumbers variance{};
  for (Eigen::Index k = 0; k < kNumbers; ++k) {
    variance[static_cast<std::size_t>(k)] =
        kCommonToAll * kCommonToAll * kOfFew * (by_pull.col(k).transpose() * pulls).squaredNorm();
    for (Eigen::Index p = 0; p < kNumbers; ++p)
      variance[static_cast<std::size_t>(k)] +=
          std::pow(by_pull(p, k) / kPriorSigma[static_cast<std::size_t>(p)], 2);
  }
  variance[4] += std::pow(kDistanceError * numbers_[4], 2);
  return variance;
}

}  // namespace

OpticsFit optics_from_motion(const std::vector<SeenFrame>& frames) {
  if (frames.empty()) throw Error("nothing touches the gel");
  const SensorOptics start = frames.front().surface->optics;
  Adjustment adjustment(frames, start);
  adjustment.solve();
  OpticsFit fit;
  fit.measurements = adjustment.pairs();
  const OpticsNumbers variance = adjustment.variance(fit.residual);
  // Relative to the prior's standard deviation. A number that is less certain keeps its initial value.
  constexpr double kShown = 0.5;
  OpticsNumbers kept = numbers_of(start);
  for (std::size_t k = 0; k < kept.size(); ++k) {
    fit.sigma[k] = std::sqrt(std::max(variance[k], 0.0));
    fit.shown[k] = fit.sigma[k] < kShown * kPriorSigma[k];
    if (fit.shown[k]) kept[k] = adjustment.numbers()[k];
  }
  fit.optics = optics_of(kept.data());
  fit.sigma[4] *= fit.optics.camera_distance_mm * fit.optics.camera_distance_mm;
  return fit;
}

std::string OpticsFit::words() const {
  std::string text;
  const auto values = values_of(optics);
  for (std::size_t k = 0; k < kNumbers; ++k)
    text += !shown[k]       ? fmt::format("{}: {:.4g}, not shown\n", kNames[k], values[k])
            : sigma[k] == 0 ? fmt::format("{}: 0, orthographic\n", kNames[k])
                            : fmt::format("{}: {:.4g} +- {:.2g}\n", kNames[k], values[k], sigma[k]);
  return text;
}

std::string OpticsFit::not_shown() const {
  std::string text;
  for (std::size_t k = 0; k < kNumbers; ++k)
    if (!shown[k]) text += (text.empty() ? "" : ", ") + std::string(kNames[k]);
  return text;
}

}  // namespace gelslam
