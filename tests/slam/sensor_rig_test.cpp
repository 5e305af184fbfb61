#include "gelslam/slam/sensor_rig.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>

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
  for (const SecondClock& clock : {SecondClock{}, SecondClock{0.3, 1.002}}) {
    const ScanRecord first = recorded(25);
    ScanRecord second = recorded(30, 0.011);
    for (FrameRecord& frame : second.frames) frame.time_s = (frame.time_s - clock.start_s) / clock.rate;
    const std::vector<RigConstraint> constraints = rig_constraints(first, second, clock);
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
  for (const RigConstraint& constraint : rig_constraints(first, second, {}))
    EXPECT_EQ(constraint.first_keyframe, 0);
  for (FrameRecord& frame : first.frames)
    if (frame.time_s < 1.1) frame.keyframe = -1;
  EXPECT_TRUE(rig_constraints(first, second, {}).empty());
}

TEST(SensorRig, WhatASurfaceDoesNotShowIsNotCompared) {
  const ScanRecord first = recorded(25);
  ScanRecord rod = recorded(25);
  for (FrameRecord& frame : rod.frames) frame.observable = {false, true, true, true, true, false};
  for (const RigConstraint& constraint : rig_constraints(first, rod, {})) {
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

/// `rate`: seconds per second that the recording's clock counts.
ScanRecord unsteadily(double rate_hz, double first_s, double length_s = 20, double rate = 1) {
  ScanRecord record = recorded(rate_hz);
  record.frames.clear();
  for (int frame = 0; frame < length_s * rate_hz; ++frame) {
    const double time_s = frame / rate_hz;
    record.frames.push_back({frame, time_s, TrackStatus::tracked, 0, 0, unsteady(first_s + rate * time_s)});
  }
  return record;
}

TEST(SensorRig, RecordingsNeedNotStartTogether) {
  for (const double offset_s : {0.0, 0.73, -2.4}) {
    const SecondClock clock = second_clock(unsteadily(25, 10), unsteadily(30, 10 + offset_s));
    EXPECT_NEAR(clock.start_s, offset_s, 0.01);
    EXPECT_EQ(clock.rate, 1);
  }
}

TEST(SensorRig, ClocksMayDrift) {
  for (const double rate : {1.001, 0.9985, 1.0})
    for (const double offset_s : {0.0, -2.4}) {
      const SecondClock clock =
          second_clock(unsteadily(25, 10, 120), unsteadily(30, 10 + offset_s, 120, rate));
      for (const double time_s : {0.0, 60.0, 120.0})
        EXPECT_NEAR(clock.start_s + clock.rate * time_s, offset_s + rate * time_s, 0.005) << rate << time_s;
      EXPECT_EQ(clock.rate == 1, rate == 1);
    }
}

TEST(SensorRig, NothingIsSaidOfRecordingsThatDoNotOverlap) {
  const ScanRecord first = unsteadily(25, 10);
  ScanRecord second = unsteadily(25, 10);
  for (FrameRecord& frame : second.frames) frame.time_s += 100;
  for (const ScanRecord& never : {second, ScanRecord{}}) {
    const SecondClock clock = second_clock(first, never);
    EXPECT_EQ(clock.start_s, 0);
    EXPECT_EQ(clock.rate, 1);
    EXPECT_TRUE(rig_constraints(first, never, clock).empty());
  }
}

TEST(SensorRig, WhatTurnsEvenlyStartsTogether) {
  EXPECT_EQ(second_clock(recorded(25), recorded(25, 0.2)).start_s, 0);
}

TEST(SensorRig, ConstraintsKnowHowFarTheGripperIsOpen) {
  const Gripper gripper{{0, 0.6, 0.8}, {{1, 0}, {2, 10}, {3, 5}}};
  for (const auto& [time_s, mm] : {std::pair(0.5, 0.0), {1.5, 5.0}, {2.0, 10.0}, {2.8, 6.0}, {4.0, 5.0}})
    EXPECT_TRUE(gripper.moved_mm(time_s).isApprox(mm * gripper.axis)) << time_s;
  const std::vector<RigConstraint> constraints = rig_constraints(recorded(25), recorded(25), {}, gripper);
  ASSERT_FALSE(constraints.empty());
  for (const RigConstraint& constraint : constraints) {
    const Pose first_place = place(2 * constraint.first_keyframe) * constraint.first_keyframe_T_sensor;
    const double time_s = se3_log(first_place)[0] / se3_log(place(1))[0];
    EXPECT_TRUE(constraint.opening_mm.isApprox(gripper.moved_mm(time_s), 1e-6)) << time_s;
  }
}

class RigFiles : public testing::Test {
 protected:
  RigFile read(const std::string& text) {
    std::ofstream(file) << text;
    return read_rig(file);
  }
  std::string failure(const std::string& text) {
    return failure_of([&] { read(text); });
  }
  std::string failure_of_openings(const std::string& text) {
    std::ofstream(file) << text;
    return failure_of([&] { read_openings(file); });
  }
  std::string failure_of(const std::function<void()>& action) {
    try {
      action();
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }
  TemporaryFolder folder;
  const std::filesystem::path file = folder / "rig.yaml";
};

TEST_F(RigFiles, HoldsThePoseOfTheSecondSensor) {
  const auto [rig, axis] = read(
      "second_x: {x: 0.866, y: 0.5, z: 0}\nsecond_y: {x: 0.5, y: -0.866, z: 0}\nsecond_z: {x: 0, y: 0, z: "
      "-1}\n"
      "second_origin: {x: 1, y: 2, z: 13}\nsigma_mm: 0.5\nopening_axis: {x: 0.6, y: 0, z: 0.8}\n");
  EXPECT_NEAR(rig.first_T_second(0, 0), std::cos(M_PI / 6), 1e-3);
  EXPECT_TRUE(rig.first_T_second.linear().isUnitary(1e-9)) << "three decimals are enough";
  EXPECT_EQ(rig.first_T_second.translation(), Eigen::Vector3d(1, 2, 13));
  EXPECT_NEAR(rig.covariance(4, 4), 0.25, 1e-12);
  EXPECT_TRUE(axis.isApprox(Eigen::Vector3d(0.6, 0, 0.8)));
  EXPECT_EQ(read("sigma_mm: 0.5\n").opening_axis, Eigen::Vector3d::UnitZ());
}

TEST_F(RigFiles, WhatIsNoRigidMotionIsRefused) {
  EXPECT_THAT(failure("second_z: {x: 0, y: 0, z: -1}\n"), HasSubstr("reflection"));
  EXPECT_THAT(failure("second_x: {x: 0.5, y: 0, z: 0}\n"), HasSubstr("length 1"));
  EXPECT_THAT(failure("second_w: {x: 0.5}\n"), HasSubstr("second_w"));
  EXPECT_THAT(failure("opening_axis: {z: 0}\n"), HasSubstr("opening_axis is not of length 1"));
  EXPECT_THAT(failure("opening_axis: {z: .nan}\n"), HasSubstr("z"));
}

TEST_F(RigFiles, OpeningsComeFromATable) {
  std::ofstream(file) << "time_s,opening_mm\r\n0,1.5\r\n\n0.5, -2\n";
  const auto openings = read_openings(file);
  ASSERT_EQ(openings.size(), 2u);
  EXPECT_EQ(openings[1].time_s, 0.5);
  EXPECT_EQ(openings[1].mm, -2);
  EXPECT_THAT(failure_of_openings("0,1\n"), HasSubstr("first line must be time_s,opening_mm"));
  EXPECT_THAT(failure_of_openings("time_s,opening_mm\n"), HasSubstr("no openings"));
  EXPECT_THAT(failure_of_openings("time_s,opening_mm\n1,2\n1,3\n"), HasSubstr("line 3: the time does not"));
  for (const char* line : {"1", "1;2", "1,2,3", "1,nan", "a,2", "1,1e9", ",", "1,2 mm"})
    EXPECT_THAT(failure_of_openings(std::string("time_s,opening_mm\n") + line + "\n"),
                HasSubstr("line 2: expected a time"))
        << line;
}

}  // namespace
}  // namespace gelslam
