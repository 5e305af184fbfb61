#include "gelslam/slam/surface_stream.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "../support/temporary_folder.hpp"
#include "../surface/linear_gel.hpp"

namespace gelslam::test {
namespace {

using testing::Contains;

/// A log of PNG pictures of a gel with known colors, either bare or with a ball pressed in.
class StreamOfALog : public testing::Test {
 protected:
  StreamOfALog() {
    fs::create_directory(folder / "log");
    write_pth_model(folder / "model.pth", linear_gel_model());
    write_optics(folder / "optics.yaml", {});  // the optics of the pictures below
    input.log = folder / "log";
    input.model = folder / "model.pth";
  }

  std::string picture(int index) const { return folder / ("log/" + std::to_string(index) + ".png"); }
  void record(int frames, bool contact) {
    for (int i = 0; i < frames; ++i, ++recorded)
      cv::imwrite(picture(recorded), contact ? touched(150 + recorded) : bare_picture(1.0, seed()));
  }
  cv::Mat3b touched(double u) const {
    return render(ball_press(kSensor, kPitchMm, u, 120, 5, 0.8), kPitchMm, 1.0, seed());
  }
  std::uint64_t seed() const { return static_cast<std::uint64_t>(recorded); }

  SurfaceStream open() { return SurfaceStream(input, resolve_config(input), timer); }
  std::string error() {
    return message_of([&] { open(); });
  }
  /// Expects that the stream has exactly `frames` frames, and that those from `first_touched` on show the
  /// touch.
  static void expect_frames(SurfaceStream& stream, int frames, int first_touched) {
    for (int i = 0; i < frames; ++i) {
      const auto item = stream.next();
      ASSERT_TRUE(item);
      EXPECT_EQ(item->image.index, i);
      EXPECT_NEAR(item->image.time_s, i / 25.0, 1e-9);
      ASSERT_EQ(item->surface != nullptr, i >= first_touched) << i;
      if (!item->surface) continue;
      const double radius_px = contact_radius_px(kPitchMm, 5, 0.8);
      // The mask is a little smaller or larger than the contact circle; within 2 pixels of its border.
      EXPECT_NEAR(item->surface->contact_pixels, M_PI * radius_px * radius_px, 4 * M_PI * radius_px);
    }
    EXPECT_FALSE(stream.next());
  }

  /// Returns a picture as a camera takes it whose channels are 0.8, 0.5 and 0.625 times as sensitive.
  static cv::Mat3b dimmed(const cv::Mat3b& bgr) {
    cv::Mat dark;
    cv::multiply(bgr, cv::Scalar(0.8, 0.5, 0.625), dark);
    return dark;
  }

  /// Returns the largest depth (mm) in the last frame of the log.
  double deepest_mm() {
    SurfaceStream stream = open();
    SurfacePtr last;
    while (const auto item = stream.next()) last = item->surface;
    double deepest = 0;
    cv::minMaxLoc(last->height_mm, &deepest);
    return -deepest;
  }

  TemporaryFolder folder;
  LogInput input;
  StageTimer timer;
  int recorded = 0;
};

TEST_F(StreamOfALog, SaysOnceThatLightIsNotFollowed) {
  record(12, false);
  for (const int index : {10, 11}) {
    cv::Mat3b bgr = cv::imread(picture(index));
    for (int u = 0; u < bgr.cols; ++u) {
      const cv::Scalar light = cv::Scalar(48, 60, 66) * std::exp(-std::pow((u - 190) / 70.0, 2));
      cv::add(bgr.col(u), light, bgr.col(u));
    }
    cv::imwrite(picture(index), bgr);
  }
  SurfaceStream stream = open();
  for (int i = 0; i < 10; ++i) stream.next();
  EXPECT_THAT(stream.background_warnings(), Not(Contains(HasSubstr("light changes"))));
  while (stream.next()) continue;
  EXPECT_THAT(stream.background_warnings(), Contains(HasSubstr("light changes")).Times(1));
}

TEST_F(StreamOfALog, HandsOutBackgroundFirstAndThenSurfaces) {
  record(10, false);
  record(3, true);
  SurfaceStream stream = open();
  EXPECT_EQ(stream.frame_count(), 13);
  expect_frames(stream, 13, 10);
  EXPECT_EQ(stream.warning(), "");
  EXPECT_NE(stream.description(), "");
}

TEST_F(StreamOfALog, ALogShorterThanItsBackgroundIsRefused) {
  record(7, false);
  EXPECT_THAT(error(), HasSubstr("only 7 frames, fewer than the 10"));
  EXPECT_THAT(error(), HasSubstr("name a background picture"));
  record(3, false);
  EXPECT_EQ(error(), "nothing was thrown");
}

TEST_F(StreamOfALog, ContactInTheBackgroundIsRefusedUnlessForced) {
  record(12, true);
  EXPECT_THAT(error(), HasSubstr("should show the bare gel"));
  EXPECT_THAT(error(), HasSubstr("continue with force"));
  input.force = true;
  EXPECT_THAT(open().background_warnings(), Contains(HasSubstr("the background shows contact")));
}

/// The log begins with two old pictures of a touch, as a camera may deliver them from its buffers.
TEST_F(StreamOfALog, TheBackgroundIsFoundBehindOldPictures) {
  record(2, true);
  record(7, false);
  record(3, true);
  SurfaceStream stream = open();
  EXPECT_THAT(stream.background_warnings(), Contains(HasSubstr("that of frames 2 to 8")));
  expect_frames(stream, 12, 9);
}

/// A damaged picture counts as one of the frames of the background. Otherwise a later frame would be used in
/// its place, in which an object may already touch the gel.
TEST_F(StreamOfALog, ADamagedPictureHasANumberInTheBackground) {
  record(10, false);
  record(3, true);
  for (const int damaged : {4, 9}) {
    write_bytes(picture(damaged), "no picture");
    SurfaceStream stream = open();
    while (const auto item = stream.next())
      EXPECT_EQ(item->surface != nullptr, item->image.index >= 10) << damaged;
    EXPECT_THAT(stream.background_warnings(), testing::Not(Contains(HasSubstr("the background is that of"))));
  }
}

TEST_F(StreamOfALog, NamedFramesAreTheBackground) {
  record(11, true);
  record(4, false);
  record(2, true);
  input.background_frames = FrameRange{11, 14};
  SurfaceStream stream = open();
  expect_frames(stream, 17, 15);
  input.background_frames = FrameRange{9, 14};
  EXPECT_THAT(error(), HasSubstr("the named frames should show the bare gel, but something moves"));
  input.background_frames = FrameRange{11, 17};
  EXPECT_THAT(error(), HasSubstr("the log ends before frame 17"));
}

TEST_F(StreamOfALog, ABackgroundThatIsNotTheLogsIsDoubted) {
  record(10, false);
  record(3, true);
  const cv::Mat3b bare = bare_picture(0, 99);
  input.background = folder / "named.png";
  const auto warnings_of = [&](const cv::Mat3b& picture) {
    cv::imwrite(input.background.string(), picture);
    SurfaceStream stream = open();
    for (int i = 0; i < 13; ++i) EXPECT_EQ(stream.next()->image.index, i) << "none is lost";
    EXPECT_FALSE(stream.next());
    return stream.background_warnings();
  };
  const auto differs = [](const char* how) {
    return Contains(testing::AllOf(HasSubstr("differs from the first frames of the log"), HasSubstr(how)));
  };
  EXPECT_THAT(warnings_of(bare), testing::Not(differs("")));
  cv::Mat3b mirrored;
  cv::flip(bare, mirrored, 1);
  EXPECT_THAT(warnings_of(mirrored), differs("left and right are swapped"));
  EXPECT_THAT(warnings_of(dimmed(bare)), differs("the light has changed"));
  EXPECT_THAT(warnings_of(render(ball_press(kSensor, kPitchMm, 100, 120, 5, 0.2), kPitchMm, 0, 1)),
              differs("touches"));
}

/// All frames show a worn spot of the gel.
TEST_F(StreamOfALog, WhatLooksLikeAnImprintInAllFramesIsBackground) {
  record(10, false);
  record(3, true);
  for (int i = 0; i < recorded; ++i) {
    cv::Mat worn = cv::imread(picture(i));
    cv::circle(worn, {240, 60}, 14, cv::Scalar(150, 180, 180), cv::FILLED);
    cv::imwrite(picture(i), worn);
  }
  SurfaceStream stream = open();
  EXPECT_THAT(stream.background_warnings(), Contains(HasSubstr("looks like an imprint")));
  expect_frames(stream, 13, 10);
}

/// The model reads bare gel as touched, because red and blue are swapped.
TEST_F(StreamOfALog, SwappedColorsAreSaidBeforeTheImprintThatTheyLookLike) {
  const cv::Mat3b gel = render(ball_press(kSensor, kPitchMm, 150, 120, 2, 0.4), kPitchMm, 0, 1);
  const auto swapped = pixel_map<cv::Vec3b>(kSensor, [&](int u, int v) {
    const double down = v / 120.0 - 1;  // reddish top, bluish bottom
    return cv::Vec3d(80 * std::exp(0.4 * down), gel(v, u)[1], gel(v, u)[2] * 1.2 * std::exp(-0.4 * down));
  });
  for (int i = 0; i < 10; ++i) cv::imwrite(picture(i), swapped);
  EXPECT_THAT(error(), HasSubstr("but red and blue seem to be swapped: the top is reddish and the bottom "
                                 "bluish; the gel already shows an imprint"));
  EXPECT_THAT(error(), HasSubstr("(force continues anyway)"));
}

TEST_F(StreamOfALog, TheConfigurationBesideTheLogIsUsed) {
  record(4, false);
  write_bytes(folder / "log/config.yaml",
              "device_config:\n  calibration_model_path: ../model.pth\ncontact_mask_config:\n  "
              "background_frames: 4\n");
  input.model.clear();
  EXPECT_EQ(error(), "nothing was thrown");
  EXPECT_EQ(resolve_config(input).background_frames, 4);
}

TEST_F(StreamOfALog, ColorGainUndoesADarkerCamera) {
  const cv::Mat3b bare = dimmed(bare_picture(0, 99)), pressed = dimmed(touched(150));
  const char* const gains =
      "device_config:\n  color_gain_blue: 1.25\n  color_gain_green: 2\n  color_gain_red: 1.6\n";
  input.background = folder / "bare.png";
  input.config = folder / "gain.yaml";
  cv::imwrite(input.background.string(), bare);
  cv::imwrite(picture(0), pressed);
  write_bytes(input.config, gains);
  // Rounding of the dark picture leaves up to one gray level: 0.4 degrees, or 1 % of the steepest slope.
  EXPECT_NEAR(deepest_mm(), 0.8, 0.02);
  write_bytes(input.config, "device_config:\n  color_gain_blue: 1.25\n");
  EXPECT_LT(deepest_mm(), 0.6) << "without the gain, slopes of half the size";
  input.background.clear();
  for (int i = 0; i < 10; ++i) cv::imwrite(picture(i), bare);
  cv::imwrite(picture(10), pressed);
  write_bytes(input.config, gains);
  EXPECT_NEAR(deepest_mm(), 0.8, 0.02) << "a background from the log gets the same gain";
}

}  // namespace
}  // namespace gelslam::test
