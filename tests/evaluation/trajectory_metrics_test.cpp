#include "gelslam/evaluation/trajectory_metrics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
using Truth = std::vector<std::optional<Pose>>;

// Written out, so that they share nothing with the code under test.
Eigen::Matrix3d about_x(double deg) {
  const double c = std::cos(deg * kRadians), s = std::sin(deg * kRadians);
  return (Eigen::Matrix3d() << 1, 0, 0, 0, c, -s, 0, s, c).finished();
}
Eigen::Matrix3d about_y(double deg) {
  const double c = std::cos(deg * kRadians), s = std::sin(deg * kRadians);
  return (Eigen::Matrix3d() << c, 0, s, 0, 1, 0, -s, 0, c).finished();
}
Eigen::Matrix3d about_z(double deg) {
  const double c = std::cos(deg * kRadians), s = std::sin(deg * kRadians);
  return (Eigen::Matrix3d() << c, -s, 0, s, c, 0, 0, 0, 1).finished();
}

Pose pose(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation_mm) {
  Pose result = Pose::Identity();
  result.linear() = rotation;
  result.translation() = translation_mm;
  return result;
}

/// A smooth motion in all six directions, beginning at identity.
Truth winding(int frames) {
  Truth truth;
  for (int i = 0; i < frames; ++i) {
    const double s = i / 20.0;
    truth.push_back(pose(about_y(20 * std::sin(s)) * about_x(10 * s) * about_z(5 * std::sin(2 * s)),
                         {2 * std::sin(s), s * s, 0.3 * (1 - std::cos(s))}));
  }
  return truth;
}

std::vector<IndexedPose> copy_of(const Truth& truth) {
  std::vector<IndexedPose> estimate;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (truth[i]) estimate.push_back({static_cast<int>(i), *truth[i]});
  }
  return estimate;
}

TEST(EulerZxy, IsTheExtrinsicSequenceOfScipy) {
  for (const double rx : {-89.0, -30.0, 0.0, 20.0, 85.0}) {
    for (const double ry : {-175.0, -40.0, 0.0, 30.0, 120.0}) {
      for (const double rz : {-120.0, 0.0, 10.0, 179.0}) {
        const Eigen::Vector3d angles = euler_zxy_deg(about_y(ry) * about_x(rx) * about_z(rz));
        EXPECT_NEAR((angles - Eigen::Vector3d(rx, ry, rz)).norm(), 0.0, 1e-9) << rx << " " << ry << " " << rz;
      }
    }
  }
  // scipy 1.10: Rotation.from_euler('xyz', [10, 20, 30], degrees=True).as_euler('zxy', degrees=True)
  // is [28.02927789, -1.03300211, 22.24598969] (z, x, y).
  const Eigen::Vector3d angles = euler_zxy_deg(about_z(30) * about_y(20) * about_x(10));
  const Eigen::Vector3d expected(-1.03300211, 22.24598969, 28.02927789);
  EXPECT_NEAR((angles - expected).norm(), 0.0, 1e-7);
}

TEST(TrajectoryMetrics, EachAxisIsCountedUnderItsName) {
  const Truth truth(11, Pose::Identity());
  std::vector<IndexedPose> estimate = copy_of(truth);
  for (std::size_t i = 1; i < estimate.size(); ++i) {
    const double sign = i % 2 == 0 ? 1.0 : -1.0;  // means of magnitudes do not cancel
    estimate[i].map_T_sensor = pose(about_y(sign * 5.0) * about_x(sign * 4.0) * about_z(sign * 6.0),
                                    sign * Eigen::Vector3d(0.1, 0.2, 0.3));
  }
  const TrajectoryMetrics metrics = evaluate_trajectory(estimate, truth, 0, 25.0);
  const double share = 10.0 / 11.0;  // the reference frame is exact
  EXPECT_NEAR((metrics.mae_mm - share * Eigen::Vector3d(0.1, 0.2, 0.3)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((metrics.mae_deg - share * Eigen::Vector3d(4, 5, 6)).norm(), 0.0, 1e-9);
  const double product = 0.1 * 0.2 * 0.3 * (4 * 0.087) * (5 * 0.087) * (6 * 0.087);
  EXPECT_NEAR(metrics.geometric_mean_mm, share * std::pow(product, 1.0 / 6.0), 1e-12);
  EXPECT_NEAR(metrics.ate_mm, std::sqrt(share * 0.14), 1e-12);
  EXPECT_NEAR(metrics.final_mm, std::sqrt(0.14), 1e-12);
}

TEST(TrajectoryMetrics, AnglesWrapAtHalfATurn) {
  Truth truth(2, Pose::Identity());
  truth[1] = pose(about_z(179.5), {0, 0, 0});
  const std::vector<IndexedPose> estimate = {{0, Pose::Identity()}, {1, pose(about_z(-179.5), {0, 0, 0})}};
  const TrajectoryMetrics metrics = evaluate_trajectory(estimate, truth, 0, 25.0);
  EXPECT_NEAR(metrics.mae_deg.z(), 0.5, 1e-9);  // one degree in one of two frames
  EXPECT_NEAR(metrics.final_deg, 1.0, 1e-9);
  EXPECT_NEAR(metrics.rotation_rmse_deg, std::sqrt(0.5), 1e-9);
}

TEST(TrajectoryMetrics, TheMapFramesPlaceDoesNotMatter) {
  const Truth truth = winding(60);
  std::vector<IndexedPose> estimate = copy_of(truth);
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const double drift = 0.01 * static_cast<double>(i);
    estimate[i].map_T_sensor = estimate[i].map_T_sensor * pose(about_x(drift), {drift, 0, 0});
  }
  const TrajectoryMetrics before = evaluate_trajectory(estimate, truth, 7, 25.0);
  const Pose elsewhere = pose(about_y(70) * about_z(130), {40, -3, 8});
  for (IndexedPose& p : estimate) p.map_T_sensor = elsewhere * p.map_T_sensor;
  Truth truth_elsewhere = truth;
  for (auto& p : truth_elsewhere) p = elsewhere.inverse() * *p;
  const TrajectoryMetrics after = evaluate_trajectory(estimate, truth_elsewhere, 7, 25.0);
  EXPECT_GT(before.ate_mm, 0.1);
  EXPECT_NEAR(before.ate_mm, after.ate_mm, 1e-9);
  EXPECT_NEAR(before.ate_aligned_mm, after.ate_aligned_mm, 1e-9);
  EXPECT_NEAR((before.mae_mm - after.mae_mm).norm() + (before.mae_deg - after.mae_deg).norm(), 0.0, 1e-8);
  EXPECT_NEAR(before.over_one_second.rotation_deg, after.over_one_second.rotation_deg, 1e-9);
}

TEST(TrajectoryMetrics, AlignmentRemovesAWrongStartAndNothingElse) {
  const Truth truth = winding(60);
  std::vector<IndexedPose> estimate = copy_of(truth);
  estimate[0].map_T_sensor = estimate[0].map_T_sensor * pose(about_z(10), {0, 0, 0});
  const TrajectoryMetrics metrics = evaluate_trajectory(estimate, truth, 0, 25.0);
  EXPECT_GT(metrics.ate_mm, 0.3);
  EXPECT_NEAR(metrics.ate_aligned_mm, 0.0, 1e-9);
  for (IndexedPose& p : estimate) p.map_T_sensor.translation() *= 1.1;  // a scale error must stay
  EXPECT_GT(evaluate_trajectory(estimate, truth, 0, 25.0).ate_aligned_mm, 0.05);
}

TEST(TrajectoryMetrics, DriftPerFrameAddsUpOverASecond) {
  const Truth truth(101, Pose::Identity());
  std::vector<IndexedPose> estimate = copy_of(truth);
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const auto n = static_cast<double>(i);
    estimate[i].map_T_sensor = pose(about_z(0.02 * n), {0, 0, 0.01 * n});
  }
  const TrajectoryMetrics metrics = evaluate_trajectory(estimate, truth, 0, 25.0);
  EXPECT_NEAR(metrics.over_one_frame.translation_mm, 0.01, 1e-12);
  EXPECT_NEAR(metrics.over_one_frame.rotation_deg, 0.02, 1e-9);
  EXPECT_NEAR(metrics.over_one_second.translation_mm, 0.25, 1e-12);
  EXPECT_NEAR(metrics.over_one_second.rotation_deg, 0.5, 1e-9);
  EXPECT_EQ(metrics.over_one_second.pairs, 76);
}

TEST(TrajectoryMetrics, GapsAreCountedAndNotBridged) {
  Truth truth = winding(20);
  truth[10] = std::nullopt;
  std::vector<IndexedPose> estimate = copy_of(truth);
  estimate.erase(estimate.begin() + 3);
  estimate.insert(estimate.begin() + 9, {10, Pose::Identity()});
  const TrajectoryMetrics metrics = evaluate_trajectory(estimate, truth, 0, 25.0);
  EXPECT_EQ(metrics.touched_frames, 19);
  EXPECT_EQ(metrics.compared_frames, 18);
  EXPECT_EQ(metrics.estimated_without_touch, 1);
  EXPECT_EQ(metrics.tracked_share(), 18.0 / 19.0);
  EXPECT_EQ(metrics.over_one_frame.pairs, 15);  // 19 steps less two at each gap
  EXPECT_LT(metrics.mae_mm.norm(), 1e-12);
}

TEST(ChooseReference, PrefersTheAnchorAndFallsBackToTheFirstCommonFrame) {
  Truth truth = winding(20);
  truth[0].reset();
  truth[1].reset();
  const auto estimate = copy_of(winding(20));
  EXPECT_EQ(choose_reference_index(estimate, truth, 5), 5);
  EXPECT_EQ(choose_reference_index(estimate, truth, 1), 2);
  EXPECT_EQ(choose_reference_index(estimate, truth, std::nullopt), 2);
  EXPECT_THROW(choose_reference_index({{0, Pose::Identity()}}, truth, 0), Error);
}

}  // namespace
}  // namespace gelslam
