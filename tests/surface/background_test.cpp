#include "gelslam/surface/background.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <random>

#include "gelslam/surface/surface_estimator.hpp"
#include "linear_gel.hpp"

namespace gelslam::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

BackgroundCheck check(const std::vector<cv::Mat3b>& frames) {
  return check_background(frames, linear_gel_model(), SurfaceOptions{});
}

/// Returns a picture of a ball that is pressed in. With a depth near 0 it shows bare gel.
cv::Mat3b touched(double depth_mm, double noise, std::uint64_t seed, double u = 140,
                  double radius_mm = 4.75) {
  return render(ball_press(kSensor, kPitchMm, u, 120, radius_mm, depth_mm), kPitchMm, noise, seed);
}

// Returns ten frames of a ball that moves by `step_px` to the right in each.
std::vector<cv::Mat3b> rolling(double depth_mm, double step_px, double noise) {
  std::vector<cv::Mat3b> frames;
  for (unsigned i = 0; i < 10; ++i) frames.push_back(touched(depth_mm, noise, i, 140 + step_px * i));
  return frames;
}

// The first frames are a quarter darker. The background must have the exposure of the last frames, and the
// change must not be taken for a touch.
TEST(BackgroundImage, IsThatOfTheLastFramesExposure) {
  std::vector<cv::Mat3b> frames;
  for (unsigned i = 0; i < 9; ++i)
    frames.emplace_back(bare_picture(1.0, i) * (1.0 - 0.25 * std::exp(-0.5 * i)));
  frames.push_back(bare_picture(1.0, 9));
  const cv::Mat3b settled = bare_picture(0.0, 0), first = frames.front().clone();
  EXPECT_LT(
      cv::norm(background_image(frames), settled, cv::NORM_L1) / static_cast<double>(3 * settled.total()),
      0.5);
  EXPECT_EQ(cv::norm(first, frames.front()), 0.0) << "the frames stay as they are";
  EXPECT_EQ(check(frames).reason, "");
}

TEST(CheckBackground, MarkersAreNoContact) {
  std::vector<cv::Mat3b> frames(4, bare_picture(1.0, 3));
  for (cv::Mat3b& frame : frames) {
    frame = frame.clone();
    for (int v = 20; v < 240; v += 34)
      for (int u = 20; u < 320; u += 34) frame(cv::Rect(u, v, 8, 8)) *= 0.3;
  }
  const BackgroundCheck result = check(frames);
  EXPECT_FALSE(result.markers);
  EXPECT_FALSE(result.contact) << result.reason;
}

TEST(CheckBackground, MovingContactIsSeen) {
  EXPECT_THAT(check(rolling(0.4, 2.0, 1.0)).reason, HasSubstr("moves on the gel"));
  EXPECT_THAT(check(rolling(0.4, 0.25, 1.0)).reason, HasSubstr("moves slowly on the gel"));
}

TEST(CheckBackground, ATouchInTheLastFrameIsSeen) {
  std::vector<cv::Mat3b> frames = rolling(1e-9, 0.0, 1.0);
  frames.back() = touched(0.15, 1.0, 99, 100);
  EXPECT_THAT(check(frames).reason, HasSubstr("frame 10 of 10"));
}

/// Returns frames of a still scene as a video codec shows it: a part of the blocks of `side_px` pixels
/// changes by up to `levels` in some frame and then stays, and everything else repeats.
std::vector<cv::Mat3b> compressed(int side_px, double levels, double share) {
  std::mt19937 random(5);
  std::vector<cv::Mat3b> frames(10, bare_picture(0.0, 0));
  for (cv::Mat3b& frame : frames) frame = frame.clone();
  for (int v = 0; v < kSensor.height; v += side_px)
    for (int u = 0; u < kSensor.width; u += side_px) {
      if (std::generate_canonical<double, 20>(random) > share) continue;
      const double jump = random() % 2 == 0 ? levels : -levels;
      for (std::size_t k = 2 + random() % 6; k < frames.size(); ++k)
        frames[k](cv::Rect(u, v, side_px, side_px) & cv::Rect({}, kSensor)) += cv::Scalar::all(jump);
    }
  return frames;
}

TEST(CheckBackground, BlocksOfACodecAreNoMotion) {
  EXPECT_EQ(check(compressed(8, 4, 0.15)).reason, "");
  EXPECT_EQ(check(compressed(16, 2.5, 0.05)).reason, "");
}

TEST(CheckBackground, CompressionThatSpoilsThePictureIsNamed) {
  EXPECT_THAT(check(compressed(64, 8, 0.3)).reason, HasSubstr("the video is compressed too much"));
  EXPECT_THAT(check(rolling(0.4, 2.0, 1.0)).reason, Not(HasSubstr("compress")));
}

/// A contact that covers most of the gel must be found as motion, too, and not be taken for noise.
TEST(CheckBackground, AWideContactThatComesIsSeen) {
  std::vector<cv::Mat3b> frames = rolling(1e-9, 0.0, 1.0);
  for (std::size_t i = 1; i < 5; ++i) frames[i] = touched(0.9, 1.0, i, 160, 60);
  EXPECT_THAT(check(frames).reason, HasSubstr("moves on the gel"));
}

/// Returns the frames of a log that begins with a dark picture and with old pictures of a touch, which is so
/// shallow that no imprint is found.
std::vector<cv::Mat3b> stale_start() {
  std::vector<cv::Mat3b> frames;
  for (unsigned i = 0; i < 20; ++i) {
    const double depth_mm = i >= 3 && i < 8 ? 0.05 : i >= 13 ? 0.5 + 0.01 * i : 1e-9;
    frames.push_back(touched(depth_mm, 1.0, i, 160, 20));
  }
  frames[0].rowRange(0, 100) *= 0.5;
  return frames;
}

TEST(FindBareStretch, IsTheLongestOneWithoutAnImprint) {
  const std::vector<cv::Mat3b> frames = stale_start();
  const auto stretch = find_bare_stretch(frames, 10, linear_gel_model(), {});
  ASSERT_TRUE(stretch);
  EXPECT_EQ(stretch->begin, 8U) << "two bare frames before it are too few, five old ones show a touch";
  EXPECT_EQ(stretch->count, 5U);
  EXPECT_EQ(find_bare_stretch(frames, 4, linear_gel_model(), {})->count, 4U);
  EXPECT_FALSE(find_bare_stretch({frames.begin() + 13, frames.end()}, 10, linear_gel_model(), {}));
}

/// Lamps that are dimmed by pulses make rows flicker during a rolling shutter. This must not be taken for
/// motion.
TEST(CheckBackground, RowsThatFlickerAreNoMotion) {
  std::vector<cv::Mat3b> frames = rolling(1e-9, 0.0, 1.0);
  for (std::size_t i = 0; i < frames.size(); ++i)
    for (int v = 0; v < kSensor.height; ++v) {
      cv::Mat3b row = frames[i].row(v);
      row *= 1 + 0.03 * std::sin(2 * M_PI * (v / 80.0 + 0.37 * static_cast<double>(i)));
    }
  EXPECT_EQ(check(frames).reason, "");
}

/// The model reads a bright spot in the coating as an imprint. The spot stays while a ball comes and goes,
/// but the imprint of an object does not.
TEST(FindBareStretch, WhatAllOfTheLogShowsIsTheGelsOwn) {
  std::vector<cv::Mat3b> worn, still, rested;
  for (unsigned i = 0; i < 20; ++i) {
    worn.push_back(touched(i < 10 ? 1e-9 : 0.5, 1.0, i, 110));
    still.push_back(touched(1e-9, 1.0, i, 110));
    rested.push_back(touched(i < 10 ? 0.5 : 0.2, 1.0, i, 110));
    for (cv::Mat3b& picture : {std::ref(worn.back()), std::ref(still.back())})
      cv::circle(picture, {225, 85}, 14, cv::Scalar(150, 180, 180), cv::FILLED);
  }
  const auto find = [](const std::vector<cv::Mat3b>& log) {
    return find_bare_stretch({log.begin(), log.begin() + 10}, 10, linear_gel_model(), {}, log);
  };
  EXPECT_TRUE(check({worn.begin(), worn.begin() + 10}).contact);
  const auto stretch = find(worn);
  ASSERT_TRUE(stretch);
  EXPECT_EQ(stretch->count, 10U);
  EXPECT_GT(stretch->imprint_mm, 0.05);
  EXPECT_FALSE(find(still)) << "an object may have rested there all the time";
  EXPECT_FALSE(find(rested));
}

TEST(CheckBackground, AContactThatRestsIsSeenByItsImprint) {
  const BackgroundCheck result = check(rolling(0.5, 0.0, 1.0));
  EXPECT_TRUE(result.contact);
  EXPECT_THAT(result.reason, HasSubstr("imprint"));
  EXPECT_THAT(check({rolling(0.5, 0.0, 1.0).front()}).reason, HasSubstr("imprint"));
}

}  // namespace
}  // namespace gelslam::test
