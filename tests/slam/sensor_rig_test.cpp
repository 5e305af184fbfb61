#include "gelslam/slam/sensor_rig.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "../support/analytic_surface.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

using namespace test;
using testing::HasSubstr;

/// Where a sensor is after so many seconds.
Pose place(double time_s) { return se3_exp(time_s * Vector6d{0.1, -0.05, 0.2, 1.0, 2.0, -0.3}); }

/// Four seconds of a sensor at this rate: two keyframes, of which the second takes over after two seconds.
ScanRecord recorded(double rate_hz, double first_s = 0) {
  ScanRecord record;
  for (int id = 0; id < 2; ++id) {
    record.keyframes.push_back(std::make_shared<Keyframe>());
    record.searched.push_back(true);
  }
  record.edges = {{0, 1, place(2), Matrix6d::Identity() * 1e4}};
  for (int frame = 0; frame < 4 * rate_hz; ++frame) {
    const double time_s = first_s + frame / rate_hz;
    const int keyframe = time_s < 2 ? 0 : 1;
    record.frames.push_back(
        {frame, time_s, TrackStatus::tracked, 0, keyframe, place(2 * keyframe).inverse() * place(time_s)});
  }
  return record;
}

TEST(SensorRig, SecondSensorIsInterpolatedAtTheFirstOnesFrames) {
  for (const double second_start_s : {0.0, 0.3}) {
    const ScanRecord first = recorded(25);
    ScanRecord second = recorded(30, 0.011);
    for (FrameRecord& frame : second.frames) frame.time_s -= second_start_s;
    const std::vector<RigConstraint> constraints = rig_constraints(first, second, second_start_s);
    ASSERT_GE(constraints.size(), 15u);
    EXPECT_LE(constraints.size(), 20u) << "five per second";
    for (const RigConstraint& constraint : constraints) {
      const Pose first_place = place(2 * constraint.first_keyframe) * constraint.first_keyframe_T_sensor,
                 second_place = place(2 * constraint.second_keyframe) * constraint.second_keyframe_T_sensor;
      EXPECT_LT((first_place.inverse() * second_place).translation().norm(), 1e-6);
      EXPECT_GT(constraint.first_covariance.trace(), 0);
    }
  }
}

TEST(SensorRig, NothingIsSaidWhereOneOfThemIsLost) {
  ScanRecord first = recorded(25), second = recorded(25);
  for (FrameRecord& frame : second.frames)
    if (frame.time_s > 1) frame.status = TrackStatus::lost;
  for (const RigConstraint& constraint : rig_constraints(first, second, 0))
    EXPECT_EQ(constraint.first_keyframe, 0);
  for (FrameRecord& frame : first.frames)
    if (frame.time_s < 1.1) frame.keyframe = -1;
  EXPECT_TRUE(rig_constraints(first, second, 0).empty());
}

TEST(SensorRig, WhatASurfaceDoesNotShowIsNotCompared) {
  const ScanRecord first = recorded(25);
  ScanRecord rod = recorded(25);
  for (FrameRecord& frame : rod.frames) frame.observable = {false, true, true, true, true, false};
  for (const RigConstraint& constraint : rig_constraints(first, rod, 0)) {
    EXPECT_LT(constraint.first_covariance.diagonal().maxCoeff(), 1e-3) << "as its edge";
    EXPECT_GT(constraint.second_covariance(3, 3), 100) << "slides along x, mm^2";
    EXPECT_GT(constraint.second_covariance(2, 2), 0.5) << "turns about z";
    EXPECT_LT(constraint.second_covariance(4, 4), 1e-3);
  }
}

/// A hand that turns faster and slower, never twice alike.
Pose unsteady(double time_s) {
  Vector6d turn = Vector6d::Zero();
  int axis = 0;
  for (const double prime : {2, 3, 5, 7, 11, 13, 17, 19, 23})
    turn[axis++ % 3] += 0.1 * std::sin(1.3 * std::sqrt(prime) * time_s);
  return se3_exp(turn);
}

/// Twenty seconds of it.
ScanRecord unsteadily(double rate_hz, double first_s) {
  ScanRecord record = recorded(rate_hz);
  record.frames.clear();
  for (int frame = 0; frame < 20 * rate_hz; ++frame) {
    const double time_s = frame / rate_hz;
    record.frames.push_back({frame, time_s, TrackStatus::tracked, 0, 0, unsteady(first_s + time_s)});
  }
  return record;
}

TEST(SensorRig, RecordingsNeedNotStartTogether) {
  for (const double offset_s : {0.0, 0.73, -2.4})
    EXPECT_NEAR(start_of_second_s(unsteadily(25, 10), unsteadily(30, 10 + offset_s)), offset_s, 0.01);
}

TEST(SensorRig, NothingIsSaidOfRecordingsThatDoNotOverlap) {
  const ScanRecord first = unsteadily(25, 10);
  ScanRecord second = unsteadily(25, 10);
  for (FrameRecord& frame : second.frames) frame.time_s += 100;
  for (const ScanRecord& never : {second, ScanRecord{}}) {
    EXPECT_EQ(start_of_second_s(first, never), 0);
    EXPECT_TRUE(rig_constraints(first, never, 0).empty());
  }
}

TEST(SensorRig, WhatTurnsEvenlyStartsTogether) {
  EXPECT_EQ(start_of_second_s(recorded(25), recorded(25, 0.2)), 0);
}

class RigFiles : public testing::Test {
 protected:
  RigPose read(const std::string& text) {
    std::ofstream(file) << text;
    return read_rig(file);
  }
  std::string failure(const std::string& text) {
    try {
      read(text);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }
  TemporaryFolder folder;
  const std::filesystem::path file = folder / "rig.yaml";
};

TEST_F(RigFiles, HoldsThePoseOfTheSecondSensor) {
  const RigPose rig = read(
      "second_x: {x: 0.866, y: 0.5, z: 0}\nsecond_y: {x: 0.5, y: -0.866, z: 0}\nsecond_z: {x: 0, y: 0, z: "
      "-1}\n"
      "second_origin: {x: 1, y: 2, z: 13}\nsigma_mm: 0.5\n");
  EXPECT_NEAR(rig.first_T_second(0, 0), std::cos(M_PI / 6), 1e-3);
  EXPECT_TRUE(rig.first_T_second.linear().isUnitary(1e-9)) << "three decimals are enough";
  EXPECT_EQ(rig.first_T_second.translation(), Eigen::Vector3d(1, 2, 13));
  EXPECT_NEAR(rig.covariance(4, 4), 0.25, 1e-12);
}

TEST_F(RigFiles, WhatIsNoRigidMotionIsRefused) {
  EXPECT_THAT(failure("second_z: {x: 0, y: 0, z: -1}\n"), HasSubstr("reflection"));
  EXPECT_THAT(failure("second_x: {x: 0.5, y: 0, z: 0}\n"), HasSubstr("length 1"));
  EXPECT_THAT(failure("second_w: {x: 0.5}\n"), HasSubstr("second_w"));
}

}  // namespace
}  // namespace gelslam
