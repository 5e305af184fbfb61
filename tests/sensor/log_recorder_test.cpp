#include "gelslam/sensor/log_recorder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <future>
#include <thread>

#include "../support/temporary_folder.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "raw_frames.hpp"

namespace gelslam::test {
namespace {

using Clock = std::chrono::steady_clock;

std::unique_ptr<LogWriter> writer_of(const fs::path& path) {
  return std::make_unique<LogWriter>(path, LogAttachments{}, 25);
}

TEST(LogRecorder, WhatDoesNotFitIsCountedAndTheRestIsThere) {
  TemporaryFolder folder;
  LogRecorderOptions options;
  options.max_waiting_bytes = 1;  // one frame at a time
  // A large picture to be made small keeps the recorder busy for longer than all of them take to be pushed,
  // however fast the disk.
  options.resize_to = mini_of({1312, 984});
  RawFrame frame = jpeg_frame(0, 1312, 984);
  LogRecorder recorder(writer_of(folder / "a.mkv"), options);
  for (int i = 0; i < 300; ++i) {
    frame.sequence = i;
    recorder.push(std::make_shared<const RawFrame>(frame));
  }
  recorder.finish();
  const LogRecorderStatus status = recorder.status();
  EXPECT_EQ(status.written + status.left_out, 300);
  EXPECT_GT(status.left_out, 0);
  EXPECT_THAT(status.warning,
              HasSubstr("the disk is too slow: " + std::to_string(status.left_out) + " frames"));
  EXPECT_FALSE(status.stopped);
  const auto log = open_raw_log(folder / "a.mkv");
  std::int64_t last = -1;
  for (const RawFrame& frame : read_all(*log)) {
    EXPECT_GT(frame.sequence, last);
    last = frame.sequence;
  }
  EXPECT_EQ(log->frame_count().value_or(-1), status.written);
}

TEST(LogRecorder, ASourceThatCanWaitLosesNothing) {
  TemporaryFolder folder;
  LogRecorderOptions options;
  options.max_waiting_bytes = 1;
  LogRecorder recorder(writer_of(folder / "a.mkv"), options);
  for (int i = 0; i < 100; ++i) recorder.push_waiting(std::make_shared<const RawFrame>(jpeg_frame(i)));
  recorder.finish();
  EXPECT_EQ(recorder.status().written, 100);
  EXPECT_EQ(recorder.status().left_out, 0);
}

TEST(LogRecorder, ResizedLogsAreTheDecodersPicturesWithoutLoss) {
  TemporaryFolder folder;
  LogRecorderOptions options;
  options.resize_to = mini_of({1312, 984});
  FrameDecoder decoder(*options.resize_to);
  LogRecorder recorder(writer_of(folder / "a.mkv"), options);
  for (int i = 0; i < 4; ++i) {
    RawFrame frame = jpeg_frame(i, 1312, 984);
    frame.sequence = 2 * i;
    if (i == 2) frame.bytes.resize(100);
    recorder.push(std::make_shared<const RawFrame>(frame));
  }
  recorder.finish();
  EXPECT_EQ(recorder.status().damaged, 1);
  const std::vector<RawFrame> got = read_all(*open_raw_log(folder / "a.mkv"));
  ASSERT_EQ(got.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const int number = i < 2 ? static_cast<int>(i) : 3;
    EXPECT_EQ(got[i].encoding, FrameEncoding::png);
    EXPECT_EQ(got[i].sequence, 2 * number);
    EXPECT_NEAR(got[i].time_s, 0.04 * number, 1e-6);
    const cv::Mat3b picture = cv::imdecode(got[i].bytes, cv::IMREAD_COLOR),
                    expected = decoder.decode(jpeg_frame(number, 1312, 984))->bgr;
    EXPECT_EQ(cv::norm(picture, expected, cv::NORM_INF), 0.0);
  }
}

TEST(LogRecorder, AFailureIsSaidAndPushGoesOn) {
  TemporaryFolder folder;
  LogRecorderOptions options;
  options.max_waiting_bytes = 1;
  LogRecorder recorder(writer_of(folder / "a.mkv"), options);
  recorder.push_waiting(std::make_shared<const RawFrame>(jpeg_frame(0)));
  recorder.push_waiting(std::make_shared<const RawFrame>(jpeg_frame(1, 32, 24)));
  for (int i = 2; i < 50; ++i) recorder.push_waiting(std::make_shared<const RawFrame>(jpeg_frame(i)));
  recorder.finish();
  EXPECT_TRUE(recorder.status().stopped);
  EXPECT_EQ(recorder.status().written, 1);
  EXPECT_THAT(recorder.status().warning,
              testing::AllOf(HasSubstr("recording stopped after 1 frame, still readable"),
                             HasSubstr("changed their size or kind")));
  EXPECT_EQ(read_all(*open_raw_log(folder / "a.mkv")).size(), 1u);

  options.resize_to.emplace();
  LogRecorder resizing(writer_of(folder / "b.mkv"), options);
  for (int i = 0; i < 3; ++i) resizing.push_waiting(std::make_shared<const RawFrame>(jpeg_frame(i)));
  resizing.finish();
  EXPECT_TRUE(resizing.status().stopped);
  EXPECT_THAT(resizing.status().warning, HasSubstr("b.mkv: recording stopped: frame 0: is 64x48 pixels"));
}

/// Frames at given times, without end until stopped.
class ListedFrames final : public RawFrameSource {
 public:
  explicit ListedFrames(std::vector<double> times_s) : times_s_(std::move(times_s)) {}
  std::optional<RawFrame> next() override {
    if (index_ == times_s_.size()) return std::nullopt;
    RawFrame frame;
    frame.time_s = times_s_[index_];
    frame.index = static_cast<std::int64_t>(index_++);
    if (handed_out) handed_out(frame.index);
    return frame;
  }
  void stop() override { stopped = true; }
  double rate_hz() const override { return 25; }
  std::string description() const override { return "list"; }
  bool stopped = false;
  std::function<void(std::int64_t index)> handed_out;

 private:
  std::vector<double> times_s_;
  std::size_t index_ = 0;
};

/// What a pause of a replay is: the frame that was due waits, and so does the clock for all after it.
TEST(Pace, HeldItWaitsAndTheClockStops) {
  for (const Pace how : {Pace::as_recorded, Pace::as_taken}) {
    const auto source = pace(std::make_unique<ListedFrames>(std::vector<double>{0, 0.02, 0.04}), how);
    ASSERT_TRUE(source->next());
    ASSERT_TRUE(source->hold(true));
    std::atomic<bool> came = false;
    std::optional<RawFrame> frame;
    Clock::time_point end_of_pause;
    {
      const std::jthread reader([&] {
        frame = source->next();
        came = true;
      });
      const Clock::time_point begin = Clock::now();
      while (Clock::now() < begin + std::chrono::milliseconds(60)) std::this_thread::yield();
      EXPECT_FALSE(came);
      end_of_pause = Clock::now();
      source->hold(false);
    }
    ASSERT_TRUE(frame);
    EXPECT_GE(frame->arrived, end_of_pause);
    ASSERT_TRUE(source->next());
    if (how == Pace::as_recorded) {
      EXPECT_GE(Clock::now() - end_of_pause, std::chrono::milliseconds(20)) << "no catching up";
    }
  }
}

TEST(Pace, NoFrameBeforeItsTime) {
  const std::vector<double> times_s{5.0, 5.02, 5.021, 5.12, 5.1, 5.16};
  const auto source = pace(std::make_unique<ListedFrames>(times_s));
  const Clock::time_point start = Clock::now();
  std::size_t count = 0;
  while (const std::optional<RawFrame> frame = source->next()) {
    const double elapsed_s = std::chrono::duration<double>(Clock::now() - start).count();
    EXPECT_GE(elapsed_s, times_s[count] - times_s[0] - 1e-9);
    EXPECT_LE(frame->arrived, Clock::now());
    EXPECT_EQ(frame->index, static_cast<std::int64_t>(count));
    ++count;
  }
  EXPECT_EQ(count, times_s.size());
}

TEST(Pace, StopWakesTheWaiting) {
  auto frames = std::make_unique<ListedFrames>(std::vector<double>{0, 20, 21});
  std::promise<void> second;
  frames->handed_out = [&](std::int64_t index) {
    if (index == 1) second.set_value();
  };
  const auto source = pace(std::move(frames));
  ASSERT_TRUE(source->next());
  std::thread stopper([&] {
    second.get_future().wait();  // it is due in 20 s
    source->stop();
  });
  EXPECT_FALSE(source->next());
  EXPECT_FALSE(source->next());
  stopper.join();
}

TEST(Pace, NobodyWaitsForADamagedTime) {
  const std::vector<double> times_s{0, 1e9, 1e300, 3000, 1e9 + 0.01};
  const auto source = pace(std::make_unique<ListedFrames>(times_s));
  const Clock::time_point start = Clock::now();
  for (std::size_t i = 0; i < times_s.size(); ++i) EXPECT_TRUE(source->next());
  EXPECT_LT(Clock::now() - start, std::chrono::seconds(5));
}

}  // namespace
}  // namespace gelslam::test
