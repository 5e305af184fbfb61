#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/videoio.hpp>

#include "../support/temporary_folder.hpp"
#include "logs/matroska_header.hpp"
#include "raw_frames.hpp"

namespace gelslam::test {
namespace {

/// Times of an uneven clock and a sequence with gaps.
std::vector<RawFrame> camera_frames(int count) {
  std::vector<RawFrame> frames;
  for (int i = 0; i < count; ++i) {
    frames.push_back(jpeg_frame(i));
    frames.back().time_s = i == 0 ? 0.0 : 0.04 * i + 1e-6 * ((i * 7919) % 997);
    frames.back().sequence = i + 3 * (i / 5);
  }
  return frames;
}

TEST(Log, BytesTimesAndSequencesComeBackAsTheyWere) {
  TemporaryFolder folder;
  const std::vector<RawFrame> sent = camera_frames(30);
  LogWriter writer(folder / "a.mkv", {}, 25);
  for (const RawFrame& frame : sent) ASSERT_TRUE(writer.write(frame));
  EXPECT_EQ(writer.frames(), 30);
  writer.close();
  EXPECT_EQ(static_cast<std::uintmax_t>(writer.bytes()), fs::file_size(folder / "a.mkv"));

  const auto log = open_raw_log(folder / "a.mkv");
  EXPECT_EQ(log->frame_count().value_or(-1), 30);
  EXPECT_NEAR(log->rate_hz(), 25, 1e-9);
  EXPECT_THAT(log->description(), HasSubstr("a.mkv, 64x48, 25 Hz, jpeg"));
  const std::vector<RawFrame> got = read_all(*log);
  ASSERT_EQ(got.size(), sent.size());
  for (std::size_t i = 0; i < sent.size(); ++i) {
    EXPECT_EQ(got[i].bytes, sent[i].bytes) << i;
    EXPECT_EQ(got[i].encoding, FrameEncoding::jpeg);
    EXPECT_EQ(cv::Size(got[i].width_px, got[i].height_px), cv::Size(64, 48));
    EXPECT_NEAR(got[i].time_s, sent[i].time_s, 0.6e-6) << i;
    EXPECT_EQ(got[i].sequence, sent[i].sequence) << i;
    EXPECT_EQ(got[i].index, sent[i].index) << i;
  }
  EXPECT_EQ(log->lost_frames(), 15) << "five gaps of three";
  EXPECT_EQ(log->warning(), "");
  EXPECT_FALSE(log->next()) << "the end stays the end";
}

/// What is read of a log of these frames, and its warning.
std::pair<std::vector<RawFrame>, std::string> written_and_read(const std::vector<RawFrame>& sent) {
  const TemporaryFolder folder;
  LogWriter writer(folder / "a.mkv", {}, 25);
  for (const RawFrame& frame : sent) EXPECT_TRUE(writer.write(frame));
  writer.close();
  const auto log = open_raw_log(folder / "a.mkv");
  std::vector<RawFrame> got = read_all(*log);
  EXPECT_EQ(got.size(), sent.size());
  got.resize(sent.size());
  return {got, log->warning()};
}

TEST(Log, TimesOnTheSystemsClockComeBackToTheMicrosecond) {
  std::vector<RawFrame> sent = camera_frames(20);
  for (RawFrame& frame : sent) frame.unix_us = 1764268461123457 + std::llround(1e6 * frame.time_s);
  sent.erase(sent.begin(), sent.begin() + 3);  // the recorder began late
  const std::vector<RawFrame> got = written_and_read(sent).first;
  for (std::size_t i = 0; i < got.size(); ++i) EXPECT_EQ(got[i].unix_us, sent[i].unix_us) << i;
  EXPECT_EQ(written_and_read({jpeg_frame(0)}).first.front().unix_us, 0) << "it does not say";
}

/// What a log with these times is read as: its times, and its warning.
std::pair<std::vector<double>, std::string> recorded_at(const std::vector<double>& recorded_s) {
  std::vector<RawFrame> sent(recorded_s.size(), jpeg_frame(0));
  for (std::size_t i = 0; i < sent.size(); ++i) sent[i].time_s = recorded_s[i];
  const auto [got, warning] = written_and_read(sent);
  std::vector<double> times_s;
  for (const RawFrame& frame : got) times_s.push_back(frame.time_s);
  return {times_s, warning};
}

TEST(Log, TimesThatDoNotGoForwardAreMended) {
  EXPECT_THAT(recorded_at({0.0, 0.04, 0.04, 0.02, 0.2, 0.16}).first,
              testing::Pointwise(testing::DoubleNear(1e-6), {0.0, 0.04, 0.08, 0.12, 0.2, 0.24}));
}

/// The wrong one is the one that those after it contradict, and it is counted.
TEST(Log, ATimeFarAheadMovesNoOther) {
  std::vector<double> whole_s;
  for (int i = 0; i < 12; ++i) whole_s.push_back(0.04 * i);
  EXPECT_EQ(recorded_at(whole_s).second, "");
  for (int wrong = 0; wrong < 10; ++wrong)
    for (const int count : {1, 2}) {
      if (wrong + count > 10) continue;
      std::vector<double> recorded_s = whole_s;
      for (int i = 0; i < count; ++i) recorded_s[static_cast<std::size_t>(wrong + i)] += 3600;
      const auto [times_s, warning] = recorded_at(recorded_s);
      if (wrong > 0 || count == 1) {
        EXPECT_THAT(times_s, testing::Pointwise(testing::DoubleNear(0.041), whole_s)) << wrong;
      }
      EXPECT_THAT(warning,
                  HasSubstr(count == 1 ? "1 time stamp is contradicted" : "2 time stamps are contradicted"));
    }
  std::vector<double> paused_s = whole_s;
  for (std::size_t i = 6; i < paused_s.size(); ++i) paused_s[i] += 3600;
  EXPECT_THAT(recorded_at(paused_s),
              testing::Pair(testing::Pointwise(testing::DoubleNear(1e-6), paused_s), ""));
}

TEST(Log, FramesOfEverySizeOfLengthField) {
  std::vector<RawFrame> sent;
  // Around 2^7, 2^14 and 2^21, where the containers' length fields grow.
  for (const std::size_t size :
       {1u, 60u, 90u, 100u, 110u, 120u, 126u, 127u, 128u, 16250u, 16330u, 16380u, 16384u, 2097000u, 2097152u})
    sent.push_back(raw_frame(FrameEncoding::jpeg, std::vector<std::uint8_t>(size, 0xd8), {64, 48},
                             static_cast<std::int64_t>(sent.size())));
  const std::vector<RawFrame> got = written_and_read(sent).first;
  for (std::size_t i = 0; i < sent.size(); ++i)
    EXPECT_TRUE(got[i].bytes == sent[i].bytes) << sent[i].bytes.size();
}

TEST(Log, AttachmentsComeBackAndAreThereBeforeTheEnd) {
  TemporaryFolder folder;
  LogAttachments sent;
  sent.sensor = "GelSight Mini R0B 28KX, /dev/video2";
  sent.camera_settings = "exposure_time_absolute 100\nwhite_balance_automatic 0\n";
  sent.config_yaml = "device_config:\n  framerate: 25\n";
  sent.model.assign("PK\3\4\0\xff", 6);
  sent.model.append(20000, '\7');
  LogWriter writer(folder / "a.mkv", sent, 25);
  writer.write(jpeg_frame(0));
  const auto check = [&](const char* when) {
    const LogAttachments got = read_log_attachments(folder / "a.mkv");
    EXPECT_EQ(got.sensor, sent.sensor) << when;
    EXPECT_EQ(got.camera_settings, sent.camera_settings) << when;
    EXPECT_EQ(got.config_yaml, sent.config_yaml) << when;
    EXPECT_EQ(got.model, sent.model) << when;
  };
  check("while it grows");
  writer.close();
  check("closed");
}

TEST(Log, BgrBecomesPngWithoutLoss) {
  cv::Mat3b noise(48, 64);
  cv::randu(noise, 0, 256);
  RawFrame second = bgr_frame(noise, 7);
  second.time_s = 0.041234;
  const std::vector<RawFrame> got = written_and_read({bgr_frame(noise, 0), second}).first;
  EXPECT_NEAR(got[1].time_s, 0.041234, 1e-7);
  EXPECT_EQ(got[1].sequence, 7);
  EXPECT_EQ(got[0].encoding, FrameEncoding::png);
  EXPECT_EQ(cv::norm(cv::imdecode(got[0].bytes, cv::IMREAD_COLOR), noise), 0.0);
  RawFrame torn = bgr_frame(noise, 1);
  torn.bytes.pop_back();
  const TemporaryFolder folder;
  LogWriter other(folder / "b.mkv", {}, 25);
  EXPECT_THROW(other.write(torn), std::invalid_argument);
}

/// What a person gets who opens the log with another program; cv2.VideoCapture in Python is the same code.
std::vector<int> numbers_by_opencv(const fs::path& path, std::vector<double>& times_ms) {
  cv::VideoCapture capture(path.string(), cv::CAP_FFMPEG);
  std::vector<int> numbers;
  cv::Mat frame;
  while (capture.read(frame)) {
    numbers.push_back(number_in(frame));
    times_ms.push_back(capture.get(cv::CAP_PROP_POS_MSEC));
  }
  return numbers;
}

TEST(Log, OtherProgramsReadItClosedOrNot) {
  TemporaryFolder folder;
  for (const bool closed : {true, false}) {
    for (const FrameEncoding encoding : {FrameEncoding::jpeg, FrameEncoding::bgr}) {
      const fs::path path =
          folder / ("a" + std::to_string(closed) + std::to_string(static_cast<int>(encoding)) + ".mkv");
      LogWriter writer(path, {"sensor", "a 1", "x: 1", "model"}, 25);
      for (int i = 0; i < 10; ++i) {
        RawFrame frame =
            encoding == FrameEncoding::jpeg ? jpeg_frame(i) : bgr_frame(numbered_picture(i, 64, 48), i);
        frame.time_s = 0.05 * i;
        ASSERT_TRUE(writer.write(frame));
      }
      if (closed) writer.close();
      std::vector<double> times_ms;
      EXPECT_THAT(numbers_by_opencv(path, times_ms), ::testing::ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9))
          << path;
      for (std::size_t i = 0; i < times_ms.size(); ++i)
        EXPECT_NEAR(times_ms[i], 50.0 * static_cast<double>(i), 0.01) << path;
      cv::VideoCapture capture(path.string(), cv::CAP_FFMPEG);
      EXPECT_NEAR(capture.get(cv::CAP_PROP_FPS), 25, 1e-3);
    }
  }
}

}  // namespace
}  // namespace gelslam::test
