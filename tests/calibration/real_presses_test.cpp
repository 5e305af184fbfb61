// The same on real presses; skipped where the data is not there.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../support/data_folder.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/calibration/circle_finder.hpp"
#include "gelslam/calibration/model_check.hpp"
#include "gelslam/calibration/model_trainer.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/surface/model_file.hpp"

namespace gelslam::test {
namespace {

namespace fs = std::filesystem;

constexpr double kPitchMm = 0.0634;

class RealPresses : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(data_ / "calibration")) GTEST_SKIP() << "no data in " << data_ << "; set GELSLAM_DATA";
  }
  const fs::path data_ = test::data_folder();
};

/// The mean of the two in the middle, of an even number.
double middle(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
}

// These labels are good to a pixel and a half per axis, and people draw the disc, which shadows move to one
// side of the ball: their centers cannot be met much closer.
TEST_F(RealPresses, CirclesAreWhereAPersonDrewThem) {
  const PressSet set = read_press_set(data_ / "calibration_b");
  std::vector<double> centers, radii;
  for (const CalibrationPress& press : set.presses) {
    const FoundCircle found = find_circle(press.bgr, set.background, 0.5 * press.diameter_mm / kPitchMm);
    EXPECT_EQ(found.problem, "") << press.name;
    centers.push_back(
        std::hypot(found.circle.u_px - press.label->u_px, found.circle.v_px - press.label->v_px));
    radii.push_back(std::abs(found.circle.radius_px - press.label->radius_px));
  }
  EXPECT_LT(middle(centers), 3.0);
  EXPECT_LT(middle(radii), 1.0);
}

TEST_F(RealPresses, TheOneWrongLabelIsLeftOut) {
  const PressSet set = read_press_set(data_ / "calibration_b");
  const BallZones zones = find_ball_zones(set, kPitchMm, false);
  ASSERT_EQ(zones.rejected.size(), 1U);
  EXPECT_EQ(set.presses[zones.rejected.front().press].name, "9.470mm/50");
}

// In one of them, in a corner, the strongest change is a part of the membrane rim only: the finder once took
// that part for the ball, and a good label was called wrong.
TEST_F(RealPresses, NoRenderedPressIsLeftOut) {
  const PressSet set = read_press_set(data_ / "calibration_sim");
  const BallZones zones = find_ball_zones(set, kPitchMm, false);
  for (const RejectedPress& press : zones.rejected)
    ADD_FAILURE() << set.presses[press.press].name << ": " << press.reason;
}

/// Every third press; `factor` on the diameters that catalog.csv says.
std::string problem_with_diameters(const fs::path& folder, double pitch_mm, double factor) {
  PressSet set = read_press_set(folder);
  fill_markers(set);
  std::vector<CalibrationPress> some;
  for (std::size_t k = 0; k < set.presses.size(); k += 3) {
    some.push_back(set.presses[k]);
    some.back().diameter_mm *= factor;
  }
  set.presses = some;
  return message_of<Error>([&] { find_ball_zones(set, pitch_mm, true); });
}

TEST_F(RealPresses, RadiiForDiametersAreRefusedAndNoRightSetIs) {
  for (const char* name :
       {"calibration", "calibration_b", "markers", "optics/calibration", "real/digit_balls"}) {
    if (!fs::exists(data_ / name)) continue;
    const double pitch_mm = std::string(name) == "real/digit_balls" ? 0.0474 : kPitchMm;
    EXPECT_EQ(problem_with_diameters(data_ / name, pitch_mm, 1.0), "nothing was thrown") << name;
    EXPECT_THAT(problem_with_diameters(data_ / name, pitch_mm, 0.5),
                testing::HasSubstr("was the radius given?"))
        << name;
  }
}

// A sphere that fits no heights made the solver's library speak on stderr.
TEST_F(RealPresses, AModelThatDoesNotFitIsCheckedInSilence) {
  const fs::path folder = data_ / "real/digit_balls";
  if (!fs::exists(folder)) GTEST_SKIP() << "no " << folder;
  const PressSet set = read_press_set(folder);
  const BallZones zones = find_ball_zones(set, 0.0474, true);
  ::testing::internal::CaptureStderr();
  const ModelCheck check =
      check_model(read_model(data_ / "calibration/model/nnmodel.pth"), set, zones.zones, 0.0474);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(check.verdict, Verdict::recalibrate);
}

}  // namespace
}  // namespace gelslam::test
