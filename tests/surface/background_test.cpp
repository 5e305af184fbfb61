#include "gelslam/surface/background.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gelslam/core/error.hpp"
#include "linear_gel.hpp"

namespace gelslam::test {
namespace {

using ::testing::HasSubstr;

constexpr double kPitchMm = 0.0634;
const cv::Size kSensor(320, 240);

BackgroundCheck check(const std::vector<cv::Mat3b>& frames) {
  return check_background(frames, linear_gel_model(), SurfaceOptions{});
}

// Ten frames of a ball, `step_px` further to the right in each.
std::vector<cv::Mat3b> rolling(double depth_mm, double step_px, double noise) {
  std::vector<cv::Mat3b> frames;
  for (int i = 0; i < 10; ++i) {
    const cv::Mat1f height = ball_press(kSensor, kPitchMm, 140 + step_px * i, 120, 4.75, depth_mm);
    frames.push_back(render(height, kPitchMm, noise, static_cast<std::uint64_t>(i)));
  }
  return frames;
}

TEST(MeanImage, IsTheMeanRoundedToTheNearestLevel) {
  const cv::Mat3b dark(4, 6, cv::Vec3b(10, 0, 255)), light(4, 6, cv::Vec3b(13, 1, 255)),
      last(4, 6, cv::Vec3b(15, 1, 255));
  const cv::Mat3b mean = mean_image({dark, light, last});
  EXPECT_EQ(mean(3, 5), cv::Vec3b(13, 1, 255));  // 12.67, 0.67, 255
}

TEST(MeanImage, RefusesNothingAndDifferentSizes) {
  EXPECT_THROW(mean_image({}), Error);
  EXPECT_THROW(mean_image({cv::Mat3b(4, 6), cv::Mat3b(6, 4)}), Error);
}

// A quarter darker at first: the picture is that of the exposure it settles at, and no touch.
TEST(BackgroundImage, IsThatOfTheLastFramesExposure) {
  std::vector<cv::Mat3b> frames;
  for (int i = 0; i < 10; ++i) {
    const cv::Mat3b gel = render(cv::Mat1f(kSensor, 0.0F), kPitchMm, 1.0, static_cast<std::uint64_t>(i));
    frames.emplace_back();
    cv::multiply(gel, cv::Scalar(1, 1, 1) * (1.0 - 0.25 * std::exp(-0.5 * i)), frames.back());
  }
  frames.back() = render(cv::Mat1f(kSensor, 0.0F), kPitchMm, 1.0, 9);
  const cv::Mat3b settled = render(cv::Mat1f(kSensor, 0.0F), kPitchMm, 0.0, 0),
                  first = frames.front().clone();
  EXPECT_LT(
      cv::norm(background_image(frames), settled, cv::NORM_L1) / static_cast<double>(3 * settled.total()),
      0.5);
  EXPECT_EQ(cv::norm(first, frames.front()), 0.0) << "the frames stay as they are";
  EXPECT_EQ(check(frames).reason, "");
}

TEST(BackgroundImage, OfSteadyLightIsTheMean) {
  const std::vector<cv::Mat3b> frames = rolling(1e-9, 0.0, 2.0);
  EXPECT_EQ(cv::norm(background_image(frames), mean_image(frames)), 0.0);
  EXPECT_THROW(background_image({}), Error);
}

TEST(CheckBackground, BareGelIsClean) {
  for (const double noise : {0.0, 1.0, 5.0}) EXPECT_EQ(check(rolling(1e-9, 0.0, noise)).reason, "") << noise;
}

TEST(CheckBackground, MarkersAreNoContact) {
  std::vector<cv::Mat3b> frames(4, render(cv::Mat1f(kSensor, 0.0F), kPitchMm, 1.0, 3));
  for (cv::Mat3b& frame : frames) {
    frame = frame.clone();
    for (int v = 20; v < 240; v += 34)
      for (int u = 20; u < 320; u += 34) frame(cv::Rect(u, v, 8, 8)) *= 0.3;
  }
  const BackgroundCheck result = check(frames);
  EXPECT_FALSE(result.markers);
  EXPECT_FALSE(result.contact) << result.reason;
}

TEST(CheckBackground, ASlowChangeOfLightIsNoContact) {
  std::vector<cv::Mat3b> frames = rolling(1e-9, 0.0, 1.0);
  for (std::size_t i = 0; i < frames.size(); ++i) frames[i] += cv::Scalar::all(static_cast<double>(i));
  EXPECT_EQ(check(frames).reason, "");
}

TEST(CheckBackground, MovingContactIsSeen) {
  EXPECT_THAT(check(rolling(0.4, 2.0, 1.0)).reason, HasSubstr("moves on the gel"));
  EXPECT_THAT(check(rolling(0.4, 0.25, 1.0)).reason, HasSubstr("moves slowly on the gel"));
}

TEST(CheckBackground, ATouchInTheLastFrameIsSeen) {
  std::vector<cv::Mat3b> frames = rolling(1e-9, 0.0, 1.0);
  frames.back() = render(ball_press(kSensor, kPitchMm, 100, 100, 4.75, 0.15), kPitchMm, 1.0, 99);
  EXPECT_THAT(check(frames).reason, HasSubstr("frame 10 of 10"));
}

TEST(CheckBackground, AContactThatRestsIsSeenByItsImprint) {
  const BackgroundCheck result = check(rolling(0.5, 0.0, 1.0));
  EXPECT_TRUE(result.contact);
  EXPECT_THAT(result.reason, HasSubstr("imprint"));
  EXPECT_THAT(check({rolling(0.5, 0.0, 1.0).front()}).reason, HasSubstr("imprint"));
}

}  // namespace
}  // namespace gelslam::test
