// One log of two sensors: LogWriter, open_raw_log, record_sensors, put_on_one_clock.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/sensor/log_recorder.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "raw_frames.hpp"

namespace gelslam {
namespace {

using test::jpeg_frame;
using test::message_of;
using test::TemporaryFolder;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

const LogAttachments kFirst{"Mini A", "gain 1\n", "a: 1\n", std::string(9000, 'a')},
    kSecond{"Mini B", "gain 2\n", "b: 2\n", std::string(8000, 'b')};

std::vector<RawFrame> read_all(RawFrameSource& source) {
  std::vector<RawFrame> frames;
  while (std::optional<RawFrame> frame = source.next()) frames.push_back(std::move(*frame));
  return frames;
}

std::vector<RawFrame> read_all(const fs::path& log) { return read_all(*open_raw_log(log)); }

fs::path second_of(const fs::path& log) { return log.string() + "#2"; }

/// The second sensor's pictures: another size, 13 ms later, every third lost.
RawFrame second_frame(std::int64_t i) {
  RawFrame frame = jpeg_frame(i, 32, 24);
  frame.time_s += 0.013;
  frame.sequence = i + i / 2;
  return frame;
}

void expect_frames(const std::vector<RawFrame>& got, std::size_t count, RawFrame (*sent)(std::int64_t)) {
  ASSERT_EQ(got.size(), count);
  for (std::size_t i = 0; i < count; ++i) {
    const RawFrame expected = sent(static_cast<std::int64_t>(i));
    EXPECT_TRUE(got[i].bytes == expected.bytes) << i;
    EXPECT_EQ(got[i].width_px, expected.width_px);
    EXPECT_NEAR(got[i].time_s, expected.time_s, 0.6e-6) << i;
    EXPECT_EQ(got[i].sequence, expected.sequence) << i;
  }
}

RawFrame first_frame(std::int64_t i) { return jpeg_frame(i); }

TEST(TwoSensors, FramesTimesAndAttachmentsOfBothComeBack) {
  const TemporaryFolder folder;
  const fs::path log = folder / "both.mkv";
  LogWriter writer(log, {{kFirst, 25}, {kSecond, 20}});
  for (int i = 0; i < 12; ++i) {
    ASSERT_TRUE(writer.write(first_frame(i)));
    if (i < 7) writer.write(second_frame(i), 1);  // it ends early
  }
  writer.close();
  EXPECT_EQ(writer.frames(), 19);
  EXPECT_THAT(sensors_of_log(log), testing::ElementsAre(log, second_of(log)));
  const auto first = open_raw_log(log), second = open_raw_log(second_of(log));
  EXPECT_EQ(first->frame_count().value_or(-1), 12);
  EXPECT_EQ(second->frame_count().value_or(-1), 7);
  EXPECT_NEAR(second->rate_hz(), 20, 1e-9);
  EXPECT_THAT(second->description(), HasSubstr("both.mkv#2, 32x24, 20 Hz, jpeg"));
  expect_frames(read_all(*first), 12, first_frame);
  expect_frames(read_all(*second), 7, second_frame);
  EXPECT_EQ(second->lost_frames(), 3);
  EXPECT_EQ(first->warning() + second->warning(), "");
  const LogAttachments a = read_log_attachments(log), b = read_log_attachments(second_of(log));
  EXPECT_EQ(a.sensor + a.camera_settings + a.config_yaml, "Mini Again 1\na: 1\n");
  EXPECT_EQ(b.sensor + b.camera_settings + b.config_yaml, "Mini Bgain 2\nb: 2\n");
  EXPECT_EQ(a.model, kFirst.model);
  EXPECT_EQ(b.model, kSecond.model);
  EXPECT_THAT(message_of<Error>([&] { open_raw_log(log.string() + "#3"); }), HasSubstr("no sensor 3"));
}

TEST(TwoSensors, ACutLogGivesWhatIsWholeOfBoth) {
  const TemporaryFolder folder;
  const fs::path log = folder / "both.mkv", cut = folder / "cut.mkv";
  LogWriter writer(log, {{kFirst, 25}, {kSecond, 25}});
  for (int i = 0; i < 6; ++i) {
    writer.write(first_frame(i));
    writer.write(second_frame(i), 1);
  }
  const std::string open = test::read_bytes(log);  // as kill -9 would leave it
  writer.close();
  for (const std::string& bytes : {open, test::read_bytes(log)}) {
    test::write_bytes(cut, bytes.substr(0, bytes.size() - 5));
    expect_frames(read_all(cut), 6, first_frame);
    expect_frames(read_all(second_of(cut)), 5, second_frame);
    EXPECT_EQ(read_log_attachments(second_of(cut)).model, kSecond.model);
  }
}

TEST(TwoSensors, TheOneThatNeverCameIsNoSensorOfTheLog) {
  const TemporaryFolder folder;
  const fs::path log = folder / "both.mkv";
  LogWriter(log, {{kFirst, 25}, {kSecond, 25}}).write(second_frame(3), 1);
  EXPECT_EQ(sensors_of_log(log).size(), 1u);
  EXPECT_EQ(read_all(log).size(), 1u);
  EXPECT_EQ(read_log_attachments(log).sensor, kSecond.sensor);
  EXPECT_EQ(read_log_attachments(log).model, kSecond.model);
}

/// Of the format of earlier versions: FNV-1a of all bytes but for the date.
TEST(TwoSensors, ALogOfOneIsByteForByteWhatItWas) {
  const TemporaryFolder folder;
  LogWriter writer(folder / "one.mkv", kFirst, 25);
  for (int i = 0; i < 3; ++i)
    writer.write(test::raw_frame(FrameEncoding::jpeg, std::vector<std::uint8_t>(200, 0xd8), 64, 48, 2 * i));
  writer.close();
  std::string bytes = test::read_bytes(folder / "one.mkv");
  bytes.replace(bytes.find("\x44\x61\x88") + 3, 8, "");
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char byte : bytes) hash = (hash ^ static_cast<std::uint8_t>(byte)) * 0x100000001b3;
  EXPECT_EQ(bytes.size(), 10198u);
  EXPECT_EQ(hash, 980996884802699953u);
}

/// Frames as from a camera that has streamed for a while: the first `old` are those that its driver kept. It
/// fails after `count` frames.
class FakeCamera final : public RawFrameSource {
 public:
  FakeCamera(std::chrono::steady_clock::time_point begin, int count, bool fails, int old = 0)
      : begin_(begin), count_(count), old_(old), fails_(fails) {}
  std::optional<RawFrame> next() override {
    if (next_ == count_ && fails_) throw Error("unplugged");
    if (next_ == count_) return std::nullopt;
    RawFrame frame = jpeg_frame(next_);
    frame.arrived = begin_ + std::chrono::milliseconds(40 * std::max(next_, old_));
    ++next_;
    return frame;
  }
  void stop() override {}
  double rate_hz() const override { return 25; }
  std::string description() const override { return "fake"; }

 private:
  std::chrono::steady_clock::time_point begin_;
  int count_, old_, next_ = 0;
  bool fails_;
};

TEST(TwoSensors, TimesOfCamerasCountFromOneStart) {
  const auto now = std::chrono::steady_clock::now();
  std::unique_ptr<RawFrameSource> a = std::make_unique<FakeCamera>(now, 30, false, 4),
                                  b = std::make_unique<FakeCamera>(now + std::chrono::milliseconds(1213), 30,
                                                                   false);
  put_on_one_clock(a, b);
  const std::vector<RawFrame> first = read_all(*a), second = read_all(*b);
  ASSERT_FALSE(first.empty());
  ASSERT_FALSE(second.empty());
  EXPECT_NEAR(first[0].time_s, 0, 1e-9);
  EXPECT_EQ(second[0].index, 0);
  const auto begin_s = [](const RawFrame& frame) {
    return std::chrono::duration<double>(frame.arrived.time_since_epoch()).count() - frame.time_s;
  };
  EXPECT_NEAR(begin_s(second[0]), begin_s(first[0]), 1e-6) << "old frames of the first would make it 160 ms";
}

struct Recorded {
  std::string thrown;
  std::vector<std::string> lost;
};

Recorded record(const fs::path& log, int first, int second, bool second_fails, bool first_fails,
                bool can_wait) {
  Recorded recorded;
  FakeCamera a({}, first, first_fails), b({}, second, second_fails);
  LogRecorder recorder(std::make_unique<LogWriter>(log, std::vector<LogTrack>{{kFirst, 25}, {kSecond, 25}}));
  const std::vector<RawFrameSource*> sources{&a, &b};
  recorded.thrown = message_of<Error>([&] {
    record_sensors(sources, recorder,
                   {can_wait, [](std::size_t, const RawFrame&) { return true; },
                    [&](const std::string& why) { recorded.lost.push_back(why); }});
  });
  recorder.finish();
  return recorded;
}

TEST(TwoSensors, WhenOneIsUnpluggedTheOtherGoesOn) {
  for (const bool can_wait : {false, true}) {
    const TemporaryFolder folder;
    const fs::path log = folder / "both.mkv";
    const Recorded recorded = record(log, 400, 5, true, false, can_wait);
    EXPECT_EQ(recorded.thrown, "nothing was thrown");
    EXPECT_THAT(recorded.lost, testing::ElementsAre("unplugged"));
    EXPECT_EQ(read_all(log).size(), 400u);
    EXPECT_EQ(read_all(second_of(log)).size(), 5u);
  }
}

TEST(TwoSensors, WhenBothAreUnpluggedThatIsTheError) {
  const TemporaryFolder folder;
  const Recorded recorded = record(folder / "both.mkv", 5, 5, true, true, false);
  EXPECT_EQ(recorded.thrown, "unplugged");
  EXPECT_EQ(recorded.lost.size(), 1u);
  EXPECT_EQ(read_all(folder / "both.mkv").size(), 5u);
}

}  // namespace
}  // namespace gelslam
