// Tests the covariance of a frame in the map that follows from tracking alone.

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

#include "gelslam/slam/map_snapshot.hpp"
#include "gelslam/slam/trajectory_uncertainty.hpp"

namespace gelslam {
namespace {

constexpr double kSigmaRad = 0.004, kSigmaMm = 0.03;

std::shared_ptr<const Keyframe> keyframe(int id, std::int64_t frame, int trial, double slope_sigma_ratio) {
  const auto surface = std::make_shared<Surface>();
  surface->slope_sigma_ratio = slope_sigma_ratio;
  return std::make_shared<Keyframe>(Keyframe{id, frame, trial, SurfacePtr(surface), {}});
}

Matrix6d step_information() {
  Vector6d diagonal;
  diagonal << Eigen::Vector3d::Constant(std::pow(kSigmaRad, -2)),
      Eigen::Vector3d::Constant(std::pow(kSigmaMm, -2));
  return diagonal.asDiagonal();
}

/// Makes the results of a tracker whose sensor rolls by `step` from keyframe to keyframe. The measured steps
/// are the true ones with random errors as large as their information says. The center of the contact is that
/// of the sensor.
class RollingTracker {
 public:
  RollingTracker(const Pose& step, unsigned seed, double slope_sigma_ratio = 1.0)
      : step_(step), generator_(seed), slope_sigma_ratio_(slope_sigma_ratio) {}

  TrackedFrame begin(int trial) {
    current_ = keyframe(next_id_++, frame_, trial, slope_sigma_ratio_);
    estimate_ = Pose::Identity();
    return tracked(std::vector<NewKeyframe>(1, NewKeyframe{current_, std::nullopt}));
  }

  TrackedFrame next() {
    const PoseGraphEdge edge{current_->id, next_id_, step_ * se3_exp(noise()), step_information()};
    current_ = keyframe(next_id_++, frame_, current_->trial, slope_sigma_ratio_);
    estimate_ = estimate_ * edge.from_T_to;
    return tracked({{current_, edge}});
  }

  /// Returns a frame that is registered to the current keyframe.
  TrackedFrame beside(const Pose& keyframe_T_frame) {
    TrackedFrame frame = tracked({});
    frame.keyframe_T_frame = keyframe_T_frame;
    frame.registration.target_T_reference = keyframe_T_frame.inverse();
    frame.registration.information = step_information();
    return frame;
  }

  const Pose& estimate() const { return estimate_; }

 private:
  Vector6d noise() {
    Vector6d xi;
    for (int i = 0; i < 6; ++i) xi[i] = normal_(generator_) * (i < 3 ? kSigmaRad : kSigmaMm);
    return xi;
  }

  TrackedFrame tracked(std::vector<NewKeyframe> added) {
    TrackedFrame frame;
    frame.frame = frame_++;
    frame.status = TrackStatus::tracked;
    frame.trial = current_->trial;
    frame.keyframe = current_;
    frame.new_keyframes = std::move(added);
    return frame;
  }

  Pose step_;
  std::mt19937 generator_;
  double slope_sigma_ratio_;
  std::normal_distribution<double> normal_;
  std::shared_ptr<const Keyframe> current_;
  Pose estimate_ = Pose::Identity();
  std::int64_t frame_ = 0;
  int next_id_ = 0;
};

Pose roll_step() { return se3_exp((Vector6d() << 0.02, 0.12, 0.01, 1.2, -0.1, 0.05).finished()); }

// Simulates many trials of 25 steps with random errors. The errors at their ends, divided by the stated
// standard deviations, must have the mean square 1 (with 400 draws it has a standard error of 0.07).
TEST(TrialMap, SaysHowFarDisturbedRollsEndFromTheTruth) {
  constexpr int kDraws = 400, kSteps = 25;
  Pose truth = Pose::Identity();
  for (int k = 0; k < kSteps; ++k) truth = truth * roll_step();
  Vector6d mean_square = Vector6d::Zero();
  for (unsigned draw = 0; draw < kDraws; ++draw) {
    RollingTracker tracker(roll_step(), draw);
    TrialMap map({.sigma = 0});
    map.add(tracker.begin(0));
    Vector6d sigma;
    for (int k = 0; k < kSteps; ++k) sigma = sigma_of(map.add(tracker.next())->map_T_frame.covariance);
    const Vector6d error = se3_log(tracker.estimate().inverse() * truth);  // rad first
    const Vector6d ordered = (Vector6d() << error.tail<3>(), error.head<3>()).finished();
    mean_square += ordered.cwiseQuotient(sigma).cwiseAbs2() / kDraws;
  }
  for (int axis = 0; axis < 6; ++axis) EXPECT_NEAR(mean_square[axis], 1.0, 0.25) << "axis " << axis;
}

// Errors by the gradient scale add up from step to step, whereas variances of noise add up. A roll of 25
// steps of 0.12 rad about y that is read 10 % too long has an error of 0.3 rad at its end, and half as much
// with a model that states half of the usual uncertainty. If 3 % of the slopes along x are read as slopes
// along y, the sensor seems to turn about its x axis by 0.03 rad for each radian of the roll. In the axes at
// the end of the roll, these turns add up to 0.03 sin(3) about x and 0.03 (1 - cos(3)) about z.
TEST(TrialMap, AGradientScaleAddsUpAlongARoll) {
  const Pose step = se3_exp((Vector6d() << 0, 0.12, 0, 0, 0, 0).finished());
  for (const double slope_sigma_ratio : {1.0, 0.5}) {
    RollingTracker tracker(step, 1, slope_sigma_ratio);
    TrialMap map({.sigma = 0.1});
    map.add(tracker.begin(0));
    Vector6d sigma;
    for (int k = 0; k < 25; ++k) sigma = sigma_of(map.add(tracker.next())->map_T_frame.covariance);
    const double noise = 5 * kSigmaRad, gain = 0.1 * slope_sigma_ratio * 25 * 0.12;
    EXPECT_NEAR(sigma[4], std::hypot(noise, gain), 0.02 * gain);
    const double mixed = 0.03 * slope_sigma_ratio;
    EXPECT_NEAR(sigma[3], std::hypot(noise, mixed * std::sin(3.0)), 0.2 * noise);
    EXPECT_NEAR(sigma[5], std::hypot(noise, mixed * (1 - std::cos(3.0))), 0.2 * noise);
  }
}

TEST(TrialMap, AFrameAddsItsOwnErrorToItsKeyframes) {
  RollingTracker tracker(Pose::Identity(), 1);
  TrialMap map({.sigma = 0});
  EXPECT_EQ(map.add(tracker.begin(0))->map_T_frame.covariance.norm(), 0.0);  // the trial's own frame
  map.add(tracker.next());
  EXPECT_NEAR(sigma_of(map.add(tracker.beside(Pose::Identity()))->map_T_frame.covariance)[0],
              std::sqrt(2.0) * kSigmaMm, 1e-3 * kSigmaMm);
  EXPECT_NEAR(sigma_of(map.add(tracker.beside(Pose::Identity()))->map_T_frame.covariance)[0],
              std::sqrt(2.0) * kSigmaMm, 1e-3 * kSigmaMm);
  // 10 mm beside the keyframe, the errors of the tilt, both of the keyframe and of the registration, move the
  // frame along z.
  const Pose far = Pose(Eigen::Translation3d(10, 0, 0));
  EXPECT_NEAR(sigma_of(map.add(tracker.beside(far))->map_T_frame.covariance)[2],
              std::sqrt(2.0) * std::hypot(kSigmaMm, 10 * kSigmaRad), 1e-3);
}

// A polished ball with a radius of 8 mm may have rolled by half a radian without being noticed. Then it has
// also slid, and its z is wrong by about 8 mm * 0.5² / 2, although z is measured to 0.01 mm. The covariance
// is compared with 20 000 random perturbations. The error of the approximation is of third order (0.5³ / 6 of
// 4 mm).
TEST(TrialMap, TurnsThatAreNotShownMoveTheFrameAlongAllAxes) {
  constexpr double kRadius = 8, kTurn = 0.5;
  Matrix6d by_cause = Matrix6d::Identity() * 0.01;
  by_cause.diagonal().head<2>().setConstant(kTurn);
  by_cause(4, 0) = -kRadius * kTurn;
  by_cause(3, 1) = kRadius * kTurn;
  RollingTracker tracker(Pose::Identity(), 1);
  TrackedFrame frame = tracker.begin(0);
  TrialMap map({.sigma = 0});
  map.add(frame);
  frame = tracker.beside(Pose::Identity());
  frame.registration.information = (by_cause * by_cause.transpose()).inverse();
  const Vector6d sigma = sigma_of(map.add(frame)->map_T_frame.covariance);

  std::mt19937 generator(1);
  std::normal_distribution<double> normal;
  Eigen::Vector3d mean_square = Eigen::Vector3d::Zero();
  constexpr int kDraws = 20000;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Vector6d causes = Vector6d::NullaryExpr([&] { return normal(generator); });
    mean_square += se3_exp(by_cause * causes).translation().cwiseAbs2() / kDraws;
  }
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(sigma[axis], std::sqrt(mean_square[axis]), 0.2 * std::sqrt(mean_square[axis])) << axis;
  EXPECT_GT(sigma[2], 1.0);
}

TEST(TrialMap, ANewTrialBeginsAnewAndALostFrameHasNone) {
  RollingTracker tracker(roll_step(), 3);
  TrialMap map({.sigma = 0.1});
  map.add(tracker.begin(0));
  for (int k = 0; k < 10; ++k) map.add(tracker.next());
  TrackedFrame lost;
  lost.status = TrackStatus::lost;
  EXPECT_FALSE(map.add(lost));
  EXPECT_EQ(map.add(tracker.begin(1))->map_T_frame.covariance.norm(), 0.0);
}

}  // namespace
}  // namespace gelslam
