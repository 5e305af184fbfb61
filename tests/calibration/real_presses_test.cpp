// The same on real presses; skipped where the data is not there.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "../support/analytic_surface.hpp"
#include "../support/data_folder.hpp"
#include "gelslam/calibration/calibrate.hpp"
#include "gelslam/calibration/circle_finder.hpp"
#include "gelslam/calibration/model_check.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/surface/model_file.hpp"

namespace gelslam::test {
namespace {

namespace fs = std::filesystem;

class RealPresses : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(data_ / "calibration")) GTEST_SKIP() << "no data in " << data_ << "; set GELSLAM_DATA";
  }
  const fs::path data_ = data_folder();
};

// These labels are good to a pixel and a half per axis, and people draw the disc, which shadows move to one
// side of the ball: their centers cannot be met much closer.
TEST_F(RealPresses, CirclesAreWhereAPersonDrewThem) {
  const PressSet set = read_press_set(data_ / "calibration_b");
  std::vector<double> centers, radii;
  for (const CalibrationPress& press : set.presses) {
    const FoundCircle found = find_circle(press.bgr, set.background, set.camera(kPitchMm), press.diameter_mm);
    EXPECT_EQ(found.problem, "") << press.name;
    centers.push_back(
        std::hypot(found.circle.u_px - press.label->u_px, found.circle.v_px - press.label->v_px));
    radii.push_back(std::abs(found.circle.radius_px - press.label->radius_px));
  }
  EXPECT_LT(median(centers), 3.0);
  EXPECT_LT(median(radii), 1.0);
}

// A sphere that fits no heights made the solver's library speak on stderr.
TEST_F(RealPresses, AModelThatDoesNotFitIsCheckedInSilence) {
  const fs::path folder = data_ / "real/digit_balls";
  if (!fs::exists(folder)) GTEST_SKIP() << "no " << folder;
  const PressSet set = read_press_set(folder);
  const BallZones zones = find_ball_zones(set, 0.0474, true);
  ::testing::internal::CaptureStderr();
  const ModelCheck check =
      check_model(std::array{read_model(data_ / "calibration/model/nnmodel.pth")}, set, zones.zones, 0.0474);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(check.verdict, Verdict::recalibrate);
}

}  // namespace
}  // namespace gelslam::test
