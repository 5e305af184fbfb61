// Circles found in pictures of the simulator, and the zones that lie on the ball.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "../support/temporary_folder.hpp"
#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/calibration/circle_finder.hpp"
#include "gelslam/core/median.hpp"
#include "simulated_presses.hpp"

namespace gelslam::test {
namespace {

using ::testing::HasSubstr;

FoundCircle found_in(const SimulatedPresses& presses, std::size_t k) {
  return find_circle(presses.set.presses[k].bgr, presses.set.background, presses.set.camera(kPitchMm),
                     presses.set.presses[k].diameter_mm);
}

TEST(FindCircle, FindsTheBallThatWasPressed) {
  const SimulatedPresses& presses = forty_presses();
  std::vector<double> center_errors, radius_errors;
  for (std::size_t k = 0; k < presses.truth.size(); ++k) {
    const FoundCircle found = found_in(presses, k);
    if (!found.problem.empty()) continue;
    const cv::Point2d& center = presses.truth[k].center_px;
    center_errors.push_back(std::hypot(found.circle.u_px - center.x, found.circle.v_px - center.y));
    radius_errors.push_back(found.circle.on_ball_px(kPitchMm) - presses.truth[k].radius_px);
  }
  EXPECT_GE(center_errors.size(), 34U);
  EXPECT_LT(median(center_errors), 0.8);
  // The true contact is where the gel leaves the ball; the lens and the gel's bend hide the last pixel or
  // two.
  EXPECT_NEAR(median(radius_errors), 0.0, 2.0);
}

/// A press in which the same ball touches a second time, moved by (du, dv) pixels.
cv::Mat3b touched_again(const SimulatedPresses& presses, std::size_t k, double du, double dv) {
  const cv::Mat3b &bgr = presses.set.presses[k].bgr, &background = presses.set.background;
  cv::Mat change, moved, sum;
  cv::subtract(bgr, background, change, cv::noArray(), CV_32FC3);
  const cv::Mat1d shift = (cv::Mat1d(2, 3) << 1, 0, du, 0, 1, dv);
  cv::warpAffine(change, moved, shift, change.size());
  cv::add(bgr, moved, sum, cv::noArray(), CV_8UC3);
  return sum;
}

/// Towards the middle of the picture from the press's own place.
double inward(const SimulatedPresses& presses, std::size_t k) {
  return presses.truth[k].center_px.x < 160.0 ? 1.0 : -1.0;
}

TEST(FindCircle, SaysWhenTwoThingsTouch) {
  const SimulatedPresses& presses = forty_presses();
  for (const std::size_t k : {0, 3, 9, 14}) {
    if (!found_in(presses, k).problem.empty()) continue;
    const double far_px = 4.0 * presses.truth[k].radius_px * inward(presses, k);
    const FoundCircle found = find_circle(touched_again(presses, k, far_px, 0.0), presses.set.background,
                                          presses.set.camera(kPitchMm), presses.set.presses[k].diameter_mm);
    EXPECT_EQ(found.problem, "two things touch the gel") << k;
  }
}

TEST(FindCircle, SaysWhenTheBallSlid) {
  const SimulatedPresses& presses = forty_presses();
  const auto& background = presses.set.background;
  constexpr int pictures = 9;
  for (const std::size_t k : {0, 3, 9, 14}) {
    ASSERT_EQ(found_in(presses, k).problem, "") << k;
    const double length_px = 1.4 * presses.truth[k].radius_px * inward(presses, k);
    cv::Mat change, sum = cv::Mat(background.size(), CV_32FC3, cv::Scalar::all(0.0)), moved, slid;
    cv::subtract(presses.set.presses[k].bgr, background, change, cv::noArray(), CV_32FC3);
    for (int step = 0; step < pictures; ++step) {
      const double along = length_px * step / (pictures - 1);
      const cv::Mat1d shift = (cv::Mat1d(2, 3) << 1, 0, along, 0, 1, 0);
      cv::warpAffine(change, moved, shift, change.size());
      sum += moved / pictures;
    }
    cv::add(background, sum, slid, cv::noArray(), CV_8UC3);
    const FoundCircle found =
        find_circle(slid, background, presses.set.camera(kPitchMm), presses.set.presses[k].diameter_mm);
    EXPECT_EQ(found.problem, "the ball slid while the picture was taken") << k;
  }
}

/// By how much the zones stay inside the true contacts.
std::vector<double> zone_gaps(const SimulatedPresses& presses, const BallZones& zones) {
  std::vector<double> gaps;
  for (const BallZone& zone : zones.zones)
    gaps.push_back(presses.truth[zone.press].radius_px - zone.radius_px);
  return gaps;
}

TEST(BallZones, LieOnTheBallHoweverTheLabelsWereDrawn) {
  const SimulatedPresses& presses = forty_presses();
  for (const auto& [factor, wider_px] : {std::pair{1.0, 0.0}, {1.0, 4.0}, {1.45, 0.0}}) {
    const BallZones zones = find_ball_zones(labelled(presses, factor, wider_px), kPitchMm, false);
    EXPECT_GE(zones.zones.size(), 35U);
    EXPECT_NEAR(median(zone_gaps(presses, zones)), 3.0, 2.0) << factor << " " << wider_px;
  }
}

/// However the circles came about.
TEST(BallZones, RefuseRadiiForDiameters) {
  for (const bool automatic : {false, true}) {
    PressSet set = automatic ? forty_presses().set : forty_labelled();
    for (CalibrationPress& press : set.presses) press.diameter_mm *= 0.5;
    EXPECT_THAT(message_of([&] { find_ball_zones(set, kPitchMm, automatic); }),
                HasSubstr("was the radius given?"));
  }
}

/// As a calibration folder.
PressSet read_back(const PressSet& set) {
  const TemporaryFolder folder;
  write_folder(folder / "set", set);
  return read_press_set(folder / "set");
}

// A light that grows on one side and fades on the other leaves the mean color as it was.
TEST(BallZones, RefusePressesInALightThatDiffersOverTheGel) {
  PressSet set = forty_presses().set;
  set.background = set.background.clone();
  for (int v = 0; v < set.background.rows; ++v)
    for (int u = 0; u < set.background.cols; ++u) {
      const double gain = 0.75 + 0.5 * u / set.background.cols;
      for (int c = 0; c < 3; ++c)
        set.background(v, u)[c] = cv::saturate_cast<std::uint8_t>(gain * set.background(v, u)[c]);
    }
  const BallZones zones = find_ball_zones(read_back(set), kPitchMm, true);
  EXPECT_TRUE(zones.zones.empty());
  ASSERT_EQ(zones.rejected.size(), set.presses.size());
  EXPECT_THAT(zones.rejected.front().reason, HasSubstr("in any light that can be followed"));
}

std::string refusal(const PressSet& set, const BallZones& zones) {
  return message_of([&] { require_good_coverage(set, zones); });
}
std::string refusal(const PressSet& set) { return refusal(set, find_ball_zones(set, kPitchMm, false)); }

TEST(Coverage, IsGoodForTheWholeSet) {
  EXPECT_EQ(refusal(forty_labelled(), zones_of_labelled()), "nothing was thrown");
}

TEST(Coverage, SaysWhatIsMissing) {
  const PressSet& whole = forty_labelled();
  PressSet few = whole;
  few.presses.resize(6);
  EXPECT_THAT(refusal(few), HasSubstr("6 of 6 presses can be used, at least 10 are needed"));
  PressSet left = whole;
  std::erase_if(left.presses, [](const CalibrationPress& press) { return press.label->u_px > 210.0; });
  EXPECT_THAT(refusal(left), HasSubstr("no press lies on the right third"));
}

TEST(PressSet, FollowsTheLight) {
  const PressSet& as_pressed = forty_labelled();
  PressSet darker = as_pressed;
  for (CalibrationPress& press : darker.presses)
    press.bgr = cv::Mat3b(press.bgr * 0.85 - cv::Scalar(8, 0, 0));
  darker = read_back(darker);
  for (std::size_t k = 0; k < darker.presses.size(); ++k) {
    EXPECT_EQ(darker.presses[k].problem, "");
    const cv::Mat3b &followed = darker.presses[k].bgr, &truth = as_pressed.presses[k].bgr;
    EXPECT_LT(cv::norm(followed, truth, cv::NORM_L1) / static_cast<double>(3 * truth.total()), 1.0) << k;
  }
}

TEST(PressSet, LeavesOutPressesOfAnotherGelUnlessForced) {
  PressSet set = forty_labelled();
  cv::cvtColor(set.presses[7].bgr, set.presses[7].bgr, cv::COLOR_BGR2RGB);
  const TemporaryFolder folder;
  write_folder(folder / "set", set);
  const PressSet read = read_press_set(folder / "set");
  for (std::size_t k = 0; k < read.presses.size(); ++k)
    EXPECT_EQ(read.presses[k].problem.empty(), k != 7) << read.presses[k].problem;
  EXPECT_EQ(read_press_set(folder / "set", true).presses[7].problem, "");
}

}  // namespace
}  // namespace gelslam::test
