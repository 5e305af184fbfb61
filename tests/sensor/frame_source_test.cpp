#include "gelslam/sensor/frame_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "../support/pictures.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

using test::message_of;
using test::number_in;
using test::numbered_picture;
using test::TemporaryFolder;
using test::write_bytes;
using test::write_video;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A sensor with few pixels, so that the tests are quick.
SensorProfile small_sensor() {
  SensorProfile profile;
  profile.width_px = 64;
  profile.height_px = 48;
  profile.frame_rate_hz = 50.0;
  return profile;
}

struct Played {
  std::vector<int> numbers;
  std::vector<double> times_s;
  std::string warning;
};

/// Everything a source gives, with what must hold for every frame checked on the way.
Played play(const std::filesystem::path& log) {
  const auto source = open_frame_source(log, small_sensor());
  Played played;
  while (const auto frame = source->next()) {
    EXPECT_EQ(frame->index, static_cast<std::int64_t>(played.numbers.size()));
    EXPECT_EQ(frame->bgr.size(), cv::Size(64, 48));
    EXPECT_TRUE(played.times_s.empty() || frame->time_s > played.times_s.back());
    played.numbers.push_back(number_in(frame->bgr));
    played.times_s.push_back(frame->time_s);
  }
  EXPECT_FALSE(source->next().has_value()) << "the end stays the end";
  played.warning = source->warning();
  return played;
}

std::string error_of(const std::filesystem::path& log) {
  return message_of<Error>([&] {
    const auto source = open_frame_source(log, small_sensor());
    while (source->next()) {
    }
  });
}

TEST(VideoSource, EveryFrameInOrderWithItsTime) {
  TemporaryFolder folder;
  struct Kind {
    const char *name, *codec;
  };
  for (const Kind kind : {Kind{"a.avi", "MJPG"}, Kind{"a.mkv", "MJPG"}, Kind{"a.mp4", "mp4v"}}) {
    write_video(folder / kind.name, kind.codec, 12, 64, 48);
    const Played played = play(folder / kind.name);
    EXPECT_THAT(played.numbers, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11)) << kind.name;
    for (std::size_t i = 0; i < played.times_s.size(); ++i)
      EXPECT_NEAR(played.times_s[i], 0.04 * static_cast<double>(i), 1e-3);
    EXPECT_EQ(played.warning, "");
    const auto source = open_frame_source(folder / kind.name, small_sensor());
    EXPECT_NEAR(source->rate_hz(), 25.0, 1e-6);
    EXPECT_EQ(source->frame_count().value_or(-1), 12);
    EXPECT_THAT(source->description(), HasSubstr(std::string(kind.name) + ", 64x48, 25 Hz"));
  }
}

TEST(VideoSource, DataFolderHoldsTheVideo) {
  TemporaryFolder folder;
  write_video(folder / "gelsight.avi", "MJPG", 3, 64, 48);
  cv::imwrite((folder / "picture.png").string(), numbered_picture(9, 64, 48));
  EXPECT_THAT(play(folder.path()).numbers, ElementsAre(0, 1, 2));
}

TEST(VideoSource, RawFramesAreCropped) {
  TemporaryFolder folder;
  write_video(folder / "raw.avi", "MJPG", 2, 320, 240);
  EXPECT_THAT(play(folder / "raw.avi").numbers, ElementsAre(0, 1));
}

TEST(VideoSource, TruncatedFileGivesWhatIsThere) {
  TemporaryFolder folder;
  for (const char* name : {"a.avi", "a.mkv"}) {
    write_video(folder / name, "MJPG", 16, 64, 48);
    const std::string bytes = test::read_bytes(folder / name);
    write_bytes(folder / name, bytes.substr(0, bytes.size() * 6 / 10));
    testing::internal::CaptureStderr();
    const Played played = play(folder / name);
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << name;
    ASSERT_GE(played.numbers.size(), 5u) << name;
    ASSERT_LT(played.numbers.size(), 12u) << name;
    for (std::size_t i = 0; i < played.numbers.size(); ++i)
      EXPECT_EQ(played.numbers[i], static_cast<int>(i)) << "no half frames";
    EXPECT_THAT(played.warning, HasSubstr("ends after " + std::to_string(played.numbers.size()))) << name;
  }
}

TEST(VideoSource, EveryTruncationIsFramesOrAnErrorAndSilent) {
  TemporaryFolder folder;
  write_video(folder / "whole.avi", "MJPG", 4, 64, 48);
  const std::string bytes = test::read_bytes(folder / "whole.avi");
  testing::internal::CaptureStderr();
  for (std::size_t length = 1; length < bytes.size(); length += bytes.size() / 30) {
    write_bytes(folder / "cut.avi", bytes.substr(0, length));
    const std::string message = error_of(folder / "cut.avi");
    EXPECT_TRUE(message == "nothing was thrown" || message.find("cut.avi") != std::string::npos) << message;
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(VideoSource, WhatIsNoVideoIsNamed) {
  TemporaryFolder folder;
  write_bytes(folder / "empty.avi", "");
  write_bytes(folder / "text.avi", "this is no video\n");
  write_bytes(folder / "list.avi", "#EXTM3U\n#EXTINF:1,\n/etc/passwd\n");
  write_bytes(folder / "noise.avi", std::string("\0\1\2\3", 4) + std::string(3000, '\xa7'));
  cv::imwrite((folder / "one.png").string(), numbered_picture(0, 64, 48));
  testing::internal::CaptureStderr();
  EXPECT_THAT(error_of(folder / "none.avi"), HasSubstr("none.avi: no such file or folder"));
  EXPECT_THAT(error_of(folder / "empty.avi"), HasSubstr("empty.avi: the file is empty"));
  EXPECT_THAT(error_of(folder / "text.avi"), HasSubstr("text.avi: not a video, but text"));
  EXPECT_THAT(error_of(folder / "list.avi"), HasSubstr("list.avi: not a video, but text"));
  EXPECT_THAT(error_of(folder / "noise.avi"), HasSubstr("noise.avi: not a video that can be read"));
  EXPECT_THAT(error_of(folder / "one.png"), HasSubstr("a single image; give the folder"));
  EXPECT_THAT(error_of("/dev/null"), HasSubstr("neither a file nor a folder"));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(VideoSource, GrayAndWrongSizesAreRefused) {
  TemporaryFolder folder;
  write_video(folder / "gray.avi", "MJPG", 2, 64, 48, 25.0, true);
  write_video(folder / "small.avi", "MJPG", 2, 48, 32);
  EXPECT_THAT(error_of(folder / "gray.avi"), HasSubstr("gray.avi, frame 0: a gray picture"));
  EXPECT_THAT(error_of(folder / "small.avi"),
              HasSubstr("small.avi, frame 0: is 48x32 pixels; GelSight Mini needs 64x48"));
}

TEST(ImageFolderSource, NaturalOrderAndTheProfilesRate) {
  TemporaryFolder folder;
  for (const char* name : {"f10.png", "f9.bmp", "f1.png", "f2.png"}) {
    cv::imwrite((folder / name).string(), numbered_picture(std::atoi(name + 1), 64, 48));
  }
  std::filesystem::rename(folder / "f9.bmp", folder / "f9.BMP");
  cv::imwrite((folder / "background.png").string(), numbered_picture(15, 64, 48));
  write_bytes(folder / ".hidden.png", "x");
  write_bytes(folder / "notes.txt", "x");
  std::filesystem::create_directory(folder / "sub.png");
  const Played played = play(folder.path());
  EXPECT_THAT(played.numbers, ElementsAre(1, 2, 9, 10));
  EXPECT_THAT(played.times_s, ElementsAre(0.0, 0.02, 0.04, 0.06));
  const auto source = open_frame_source(folder.path(), small_sensor());
  EXPECT_EQ(source->frame_count().value_or(-1), 4);
  EXPECT_THAT(source->description(), HasSubstr("of 4 images, 50 Hz"));
}

TEST(ImageFolderSource, UnusableFoldersAreNamed) {
  TemporaryFolder folder;
  EXPECT_THAT(error_of(folder.path()), HasSubstr("holds neither log.mkv nor gelsight.avi nor images"));
  cv::imwrite((folder / "2.png").string(), cv::Mat1b(48, 64, uchar{7}));
  EXPECT_THAT(error_of(folder.path()), HasSubstr("2.png: a gray image"));
  cv::imwrite((folder / "2.png").string(), numbered_picture(1, 65, 48));
  EXPECT_THAT(error_of(folder.path()), HasSubstr("2.png: is 65x48 pixels"));
  write_bytes(folder / "2.png", "");
  EXPECT_THAT(error_of(folder.path()), HasSubstr("2.png: the file is empty"));
}

TEST(ImageFolderSource, DamagedPicturesAreLeftOutAndTheRestKeepTheirTimes) {
  TemporaryFolder folder;
  for (int i = 0; i < 6; ++i)
    cv::imwrite((folder / (std::to_string(i) + ".png")).string(), numbered_picture(i, 64, 48));
  write_bytes(folder / "0.png", "");
  cv::imwrite((folder / "3.png").string(), cv::Mat1b(48, 64, uchar{7}));
  const auto source = open_frame_source(folder.path(), small_sensor());
  std::vector<int> numbers;
  while (const auto image = source->next()) {
    numbers.push_back(number_in(image->bgr));
    EXPECT_EQ(image->index, numbers.back());
    EXPECT_NEAR(image->time_s, 0.02 * numbers.back(), 1e-9);
  }
  EXPECT_THAT(numbers, ElementsAre(1, 2, 4, 5));
  EXPECT_THAT(source->warning(), HasSubstr("left out 2 damaged pictures (the first: "));
  EXPECT_THAT(source->warning(), HasSubstr("0.png: the file is empty"));
}

// As a camera gives that has just been switched on, or was nudged.
TEST(VideoSource, BlackPicturesAreLeftOutAndTheRestKeepTheirTimes) {
  TemporaryFolder folder;
  {
    cv::VideoWriter writer((folder / "a.avi").string(), cv::CAP_FFMPEG,
                           cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 50, {64, 48});
    for (int i = 0; i < 7; ++i)
      writer.write(i == 0 || i == 4 ? cv::Mat3b(48, 64, cv::Vec3b(0, 0, 0)) : numbered_picture(i, 64, 48));
  }
  const auto source = open_frame_source(folder / "a.avi", small_sensor());
  std::vector<int> numbers;
  while (const auto image = source->next()) {
    numbers.push_back(number_in(image->bgr));
    EXPECT_EQ(image->index, numbers.back());
    EXPECT_NEAR(image->time_s, 0.02 * numbers.back(), 1e-6);
  }
  EXPECT_THAT(numbers, ElementsAre(1, 2, 3, 5, 6));
  EXPECT_THAT(source->warning(), HasSubstr("left out 2 damaged pictures (the first: "));
  EXPECT_THAT(source->warning(), HasSubstr("a.avi, frame 0: a gray picture"));
}

}  // namespace
}  // namespace gelslam
