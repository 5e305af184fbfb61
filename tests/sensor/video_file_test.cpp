#include "images/video_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

extern "C" {
#include <libavutil/log.h>
}

#include <opencv2/videoio.hpp>

#include "../support/pictures.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/image_input.hpp"

namespace gelslam::test {
namespace {

using detail::VideoFile;

/// cv::VideoCapture is the independent computation: its pictures, times, rate and count. It rounds colors
/// more coarsely.
void expect_as_opencv(const fs::path& path, int most_frames = 1000) {
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
    ASSERT_LE(cv::norm(image->bgr, picture, cv::NORM_L1) / static_cast<double>(3 * picture.total()), 3.0)
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
      const fs::path path = folder / (std::to_string(size.width) + kind.name);
      try {
        write_video(path, kind.codec, 9, size.width, size.height, 29.97);
      } catch (const std::runtime_error&) {
        continue;  // this build of FFmpeg cannot encode it
      }
      if (fs::file_size(path) < 1000) continue;  // not at this size
      expect_as_opencv(path);
      ++written;
    }
  }
  EXPECT_GE(written, 20);
}

TEST(VideoFile, LeavesTheLogLevelOfTheProcess) {
  const TemporaryFolder folder;
  write_video(folder / "a.mp4", "mp4v", 3, 64, 48);
  const int before = av_log_get_level();
  av_log_set_level(AV_LOG_INFO);
  {
    VideoFile video(folder / "a.mp4");
    EXPECT_TRUE(video.next());
    EXPECT_EQ(av_log_get_level(), AV_LOG_INFO);
  }
  EXPECT_EQ(av_log_get_level(), AV_LOG_INFO);
  av_log_set_level(before);
}

std::string mp4_of(const cv::Mat3b& picture, const fs::path& path) {
  cv::VideoWriter writer(path.string(), cv::CAP_FFMPEG, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 25,
                         picture.size());
  for (int i = 0; i < 3; ++i) writer.write(picture);
  writer.release();
  return read_bytes(path);
}

cv::Mat3b first_picture(const fs::path& path) {
  return FrameDecoder().decode(VideoFile(path).next()->frame)->bgr;
}

/// The track's matrix turns what is shown, as telephones write it: x to y, and y to -x, is clockwise.
TEST(VideoFile, RotationTagsAreObeyedAndMirrorsNamed) {
  const TemporaryFolder folder;
  cv::Mat3b picture(48, 64, cv::Vec3b(200, 120, 60));
  picture(cv::Rect(0, 0, 20, 16)) = cv::Vec3b(20, 30, 240);  // the upper left corner
  std::string bytes = mp4_of(picture, folder / "a.mp4");
  const std::size_t matrix = bytes.find("tkhd") + 44;
  const auto show = [&](int a, int b, int c, int d) {
    const int values[] = {a, b, c, d};
    const std::size_t at[] = {0, 4, 12, 16};
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 4; ++k)
        bytes[matrix + at[i] + static_cast<std::size_t>(k)] =
            static_cast<char>(static_cast<std::uint32_t>(values[i] * 65536) >> (24 - 8 * k));
    write_bytes(folder / "b.mp4", bytes);
  };
  const cv::Mat3b upright = first_picture(folder / "a.mp4");
  cv::Mat3b expected;
  show(0, 1, -1, 0);
  cv::rotate(upright, expected, cv::ROTATE_90_CLOCKWISE);
  EXPECT_EQ(cv::norm(first_picture(folder / "b.mp4"), expected), 0.0);
  EXPECT_EQ(VideoFile(folder / "b.mp4").properties().width_px, 48);
  show(-1, 0, 0, -1);
  cv::rotate(upright, expected, cv::ROTATE_180);
  EXPECT_EQ(cv::norm(first_picture(folder / "b.mp4"), expected), 0.0);
  show(-1, 0, 0, 1);
  EXPECT_THAT(message_of([&] { VideoFile(folder / "b.mp4"); }), testing::HasSubstr("mirrored"));
}

/// Without loss (YUV4MPEG), so that the definition of BT.601 says what each picture is.
TEST(VideoFile, ColorsOfHalfResolutionHaveNoBias) {
  const TemporaryFolder folder;
  for (const char* sampling : {"420jpeg", "422"}) {
    std::string bytes = "YUV4MPEG2 W64 H48 F25:1 Ip A1:1 C" + std::string(sampling) + "\n";
    const std::size_t chroma = 32 * (sampling[2] == '0' ? 24 : 48);
    std::vector<cv::Vec2d> colors;
    for (int u = 60; u <= 200; u += 35)
      for (int v = 60; v <= 200; v += 35) {
        colors.emplace_back(u - 128, v - 128);
        bytes += "FRAME\n";
        for (int y = 0; y < 64 * 48; ++y) bytes += static_cast<char>(100 + y % 50);
        bytes += std::string(chroma, static_cast<char>(u)) + std::string(chroma, static_cast<char>(v));
      }
    write_bytes(folder / "a.y4m", bytes);
    VideoFile video(folder / "a.y4m");
    FrameDecoder decoder;
    cv::Scalar sum;
    for (const cv::Vec2d& color : colors) {
      const cv::Mat3b picture = decoder.decode(video.next()->frame)->bgr;
      for (int y = 0; y < 64 * 48; ++y) {
        const double luma = 1.164383 * (100 + y % 50 - 16);
        const double expected[] = {luma + 2.017232 * color[0],
                                   luma - 0.391762 * color[0] - 0.812968 * color[1],
                                   luma + 1.596027 * color[1]};
        for (int c = 0; c < 3; ++c)
          sum[c] += picture(y / 64, y % 64)[c] - std::clamp(expected[c], 0.0, 255.0);
      }
    }
    for (int c = 0; c < 3; ++c)
      EXPECT_LT(std::abs(sum[c]) / (64 * 48 * static_cast<double>(colors.size())), 0.3) << sampling << c;
  }
}

}  // namespace
}  // namespace gelslam::test
