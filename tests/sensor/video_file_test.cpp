#include "images/video_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <random>

#include "../support/data_folder.hpp"
#include "../support/pictures.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/image_input.hpp"

namespace gelslam {
namespace {

using detail::VideoFile;
using test::numbered_picture;
using test::TemporaryFolder;

/// cv::VideoCapture is the independent computation: its pictures, times, rate and count. What is decoded here
/// is the same to the bit; a JPEG decoder and FFmpeg's conversion of colors differ by their rounding.
void expect_as_opencv(const std::filesystem::path& path, int most_frames = 1000) {
  cv::VideoCapture expected(path.string(), cv::CAP_FFMPEG);
  ASSERT_TRUE(expected.isOpened()) << path;
  VideoFile video(path);
  EXPECT_EQ(video.properties().width_px, expected.get(cv::CAP_PROP_FRAME_WIDTH)) << path;
  EXPECT_EQ(video.properties().height_px, expected.get(cv::CAP_PROP_FRAME_HEIGHT)) << path;
  EXPECT_NEAR(video.properties().rate_hz, expected.get(cv::CAP_PROP_FPS), 1e-9) << path;
  EXPECT_EQ(video.properties().frames.value_or(-1), expected.get(cv::CAP_PROP_FRAME_COUNT)) << path;
  cv::Mat picture;
  FrameDecoder decoder;
  int count = 0;
  double last_s = -1;
  std::int64_t first_us = 0;
  while (count < most_frames && expected.read(picture)) {
    const auto packet = video.next();
    ASSERT_TRUE(packet) << path << " ends after " << count;
    const auto image = decoder.decode(packet->frame);
    ASSERT_TRUE(image) << path << ": " << decoder.damage();
    ASSERT_EQ(image->bgr.size(), picture.size()) << path << " " << count;
    const bool same_decoder = packet->frame.encoding != FrameEncoding::jpeg;
    ASSERT_LE(cv::norm(image->bgr, picture, cv::NORM_L1) / static_cast<double>(3 * picture.total()),
              same_decoder ? 0.0 : 3.0)
        << path << ", frame " << count;
    ASSERT_TRUE(packet->time_us);
    if (count == 0) first_us = *packet->time_us;
    const double time_of_frame_s = static_cast<double>(*packet->time_us - first_us) * 1e-6;
    // OpenCV has no times for the frames that a decoder has kept until the end.
    if (const double time_s = expected.get(cv::CAP_PROP_POS_MSEC) / 1000.0; count == 0 || time_s > 0) {
      EXPECT_NEAR(time_of_frame_s, time_s, 2e-6) << path << ", frame " << count;
    }
    EXPECT_GT(time_of_frame_s, last_s);
    last_s = time_of_frame_s;
    ++count;
  }
  EXPECT_GT(count, 0) << path;
  if (count < most_frames) {
    EXPECT_FALSE(video.next()) << path;
    EXPECT_FALSE(video.next()) << path << ": the end stays the end";
  }
}

TEST(VideoFile, PicturesTimesAndCountsAreThoseOfOpenCV) {
  TemporaryFolder folder;
  struct Kind {
    const char *name, *codec;
  };
  const std::vector<Kind> kinds = {{"mjpeg.avi", "MJPG"}, {"mjpeg.mkv", "MJPG"}, {"mpeg4.mp4", "mp4v"},
                                   {"mpeg4.avi", "XVID"}, {"h264.mp4", "avc1"},  {"h264.mkv", "H264"},
                                   {"vp8.mkv", "VP80"},   {"ffv1.mkv", "FFV1"},  {"raw.avi", "I420"},
                                   {"huff.avi", "HFYU"},  {"png.avi", "MPNG"}};
  int written = 0;
  for (const Kind& kind : kinds) {
    for (const cv::Size size : {cv::Size(320, 240), cv::Size(98, 62), cv::Size(75, 53)}) {
      const std::filesystem::path path = folder / (std::to_string(size.width) + kind.name);
      try {
        test::write_video(path, kind.codec, 9, size.width, size.height, 29.97);
      } catch (const std::runtime_error&) {
        continue;  // this build of FFmpeg cannot encode it
      }
      if (std::filesystem::file_size(path) < 1000) continue;  // not at this size
      expect_as_opencv(path);
      ++written;
    }
  }
  EXPECT_GE(written, 20);
}

TEST(VideoFile, RecordedVideosAreReadAsByOpenCV) {
  const std::filesystem::path video = test::data_folder() / "sequences/track_golf/gelsight.avi";
  if (!std::filesystem::exists(video)) GTEST_SKIP() << "no data; set GELSLAM_DATA";
  expect_as_opencv(video, 40);
}

TEST(VideoFile, DamageIsFramesOrAnErrorAndSilent) {
  TemporaryFolder folder;
  std::minstd_rand random(3);
  testing::internal::CaptureStderr();
  for (const auto& [name, codec] : {std::pair{"a.avi", "MJPG"}, {"a.mp4", "mp4v"}, {"a.mkv", "H264"}}) {
    test::write_video(folder / name, codec, 6, 64, 48);
    const std::string good = test::read_bytes(folder / name);
    for (int i = 0; i < 60; ++i) {
      std::string bytes = good;
      for (int flips = 0; flips < 20; ++flips) {
        const std::size_t at = random() % bytes.size();
        bytes[random() % 2 == 0 ? at : at % 300] = static_cast<char>(random());
      }
      test::write_bytes(folder / name, bytes);
      try {
        VideoFile video(folder / name);
        for (int frames = 0; frames < 100 && video.next(); ++frames) {
        }
      } catch (const Error& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr(name));
      }
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(VideoFile, PicturesThatChangeTheirSizeAreDamaged) {
  TemporaryFolder folder;
  // A stream of JPEG pictures, one after the other.
  std::string bytes;
  for (const cv::Size size : {cv::Size(64, 48), {64, 48}, {98, 62}, {32, 80}, {64, 48}}) {
    std::vector<uchar> jpeg;
    cv::imencode(".jpg", numbered_picture(4, size.width, size.height), jpeg);
    bytes.append(jpeg.begin(), jpeg.end());
  }
  test::write_bytes(folder / "a.mjpeg", bytes);
  VideoFile video(folder / "a.mjpeg");
  FrameDecoder decoder;
  while (const auto packet = video.next()) {
    const auto image = decoder.decode(packet->frame);
    EXPECT_TRUE(!image || test::number_in(image->bgr) == 4);
  }
  EXPECT_EQ(decoder.good(), 3);
  EXPECT_THAT(decoder.first_damage(), testing::HasSubstr("98x62 pixels, announced were 64x48"));
}

TEST(ReadImage, BmpIsReadAsByOpenCV) {
  TemporaryFolder folder;
  const std::filesystem::path file = folder / "a.bmp";
  for (const cv::Size size : {cv::Size(320, 240), cv::Size(75, 53), cv::Size(2, 1)}) {
    const cv::Mat3b picture = numbered_picture(7, size.width, size.height);
    cv::imwrite(file.string(), picture);
    EXPECT_EQ(cv::norm(read_image(file), picture, cv::NORM_INF), 0.0) << size;
    cv::Mat with_alpha;
    cv::cvtColor(picture, with_alpha, cv::COLOR_BGR2BGRA);
    cv::imwrite(file.string(), with_alpha);
    EXPECT_EQ(cv::norm(read_image(file), picture, cv::NORM_INF), 0.0) << size;
  }
  cv::imwrite(file.string(), cv::Mat1b(48, 64, uchar{90}));
  EXPECT_THAT(test::message_of<Error>([&] { read_image(file); }), testing::HasSubstr("a gray picture"));
}

}  // namespace
}  // namespace gelslam
