#include <gtest/gtest.h>

#include <cmath>

#include "../support/analytic_surface.hpp"
#include "protocols/benchmark.hpp"

namespace gelslam {
namespace {

using namespace test;

/// A frame whose estimate is off by the given slide and twist from a truth of 1 mm and 10 degrees.
FrameEstimate off_by(int frame, double x_mm, double twist_deg, double ms, bool tracked = true) {
  FrameEstimate estimate;
  estimate.frame = frame;
  estimate.tracked = tracked;
  estimate.true_first_T_frame = motion(0, 0, 10, 1, 0, 0);
  estimate.first_T_frame = motion(0, 0, 10 + twist_deg, 1 + x_mm, 0, 0);
  estimate.cpu_ms = ms;
  return estimate;
}

BenchmarkResult two_methods() {
  return {{"a", "bead", "bead1", {off_by(5, 0, 0, 9), off_by(6, 0.2, 1, 1), off_by(7, -0.4, -2, 2)}},
          {"b", "bead", "bead1", {off_by(5, 0, 0, 9), off_by(6, 1, 0, 30, false), off_by(7, 1, 0, 50)}},
          {"a", "bead", "bead2", {off_by(3, 0, 0, 9), off_by(4, 0.6, 3, 4)}},
          {"a", "key, brass", "key1", {off_by(0, 0, 0, 9), off_by(1, 0, 350, 8)}}};
}

TEST(Accuracy, IsTheMeanAbsoluteErrorOverAllFramesOfAnObject) {
  const auto rows = accuracy_by_object(two_methods());
  ASSERT_EQ(rows.size(), 5U);
  const AccuracyRow& a = rows[0];
  EXPECT_EQ(a.method, "a");
  EXPECT_EQ(a.object, "bead");
  EXPECT_EQ(a.trials, 2);
  EXPECT_EQ(a.frames, 5);
  EXPECT_NEAR(a.mae[0], (0.2 + 0.4 + 0.6) / 5, 1e-9);
  EXPECT_NEAR(a.mae[5], (1.0 + 2 + 3) / 5, 1e-9);
  EXPECT_NEAR(a.mae[1], 0, 1e-9);
  EXPECT_NEAR(a.final_mm, 0.5 * (0.4 + 0.6), 1e-9);
  EXPECT_NEAR(a.final_deg, 0.5 * (2 + 3), 1e-6);
  EXPECT_EQ(a.median_ms, 2) << "the first frame of a trial is not registered";
  EXPECT_EQ(rows[1].method, "b");
  EXPECT_NEAR(rows[1].tracked_share(), 2.0 / 3, 1e-9);
  EXPECT_EQ(rows[2].object, "key, brass");
  EXPECT_NEAR(rows[2].mae[5], 10.0 / 2, 1e-6) << "350 degrees off are 10 degrees off";
  EXPECT_EQ(rows[3].object, "all");
  EXPECT_EQ(rows[3].frames, 7);
}

TEST(Accuracy, GeometricMeanCountsADegreeAs87Micrometers) {
  FrameEstimate frame;
  frame.first_T_frame = motion(0, 0, 2, 0.1, 0.2, 0.3);
  frame.first_T_frame.linear() =  // Ry Rx Rz
      so3_exp({0, 1 * kDegree, 0}) * so3_exp({1 * kDegree, 0, 0}) * so3_exp({0, 0, 2 * kDegree});
  EXPECT_NEAR(accuracy_by_object({{"a", "o", "t", {frame}}}).at(0).geometric_mean_mm,
              std::pow(0.1 * 0.2 * 0.3 * 1 * 1 * 2 * std::pow(0.087, 3), 1.0 / 6), 1e-9);
}

}  // namespace
}  // namespace gelslam
