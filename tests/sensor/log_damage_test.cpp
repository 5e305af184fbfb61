#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/file_size_limit.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"
#include "raw_frames.hpp"

namespace gelslam::test {
namespace {

const LogAttachments kSomeAttachments{"GelSight Mini", "exposure 100\n", "device_config:\n  framerate: 25\n",
                                      std::string(900, 'm')};

struct Recorded {
  std::string bytes;
  std::vector<std::size_t> ends;  ///< file size after each frame
};

Recorded record(const fs::path& path, int frames, bool close) {
  LogWriter writer(path, kSomeAttachments, 25);
  Recorded recorded;
  for (int i = 0; i < frames; ++i) {
    EXPECT_TRUE(writer.write(jpeg_frame(i)));
    recorded.ends.push_back(static_cast<std::size_t>(writer.bytes()));
  }
  if (close) writer.close();
  recorded.bytes = read_bytes(path);
  return recorded;
}

struct Outcome {
  std::vector<RawFrame> frames;
  std::string warning, error;
};

Outcome read_log(const fs::path& path) {
  Outcome outcome;
  try {
    read_log_attachments(path);
    const auto log = open_raw_log(path);
    while (std::optional<RawFrame> frame = log->next()) outcome.frames.push_back(std::move(*frame));
    outcome.warning = log->warning();
  } catch (const Error& error) {
    outcome.error = error.what();
  }
  return outcome;
}

void expect_first_frames(const Outcome& outcome, std::size_t count) {
  ASSERT_EQ(outcome.frames.size(), count);
  for (std::size_t i = 0; i < count; ++i)
    EXPECT_TRUE(outcome.frames[i].bytes == jpeg_frame(static_cast<std::int64_t>(i)).bytes) << i;
}

TEST(DamagedLog, EveryCutGivesAllFramesBeforeIt) {
  TemporaryFolder folder;
  for (const bool closed : {true, false}) {
    const Recorded recorded = record(folder / (closed ? "closed.mkv" : "open.mkv"), 6, closed);
    const std::size_t header = recorded.bytes.find("\x1f\x43\xb6\x75");
    testing::internal::CaptureStderr();
    for (std::size_t length = 5; length < recorded.bytes.size(); length += length < header + 200 ? 3 : 53) {
      write_bytes(folder / "cut.mkv", recorded.bytes.substr(0, length));
      const Outcome outcome = read_log(folder / "cut.mkv");
      const auto whole = static_cast<std::size_t>(std::count_if(
          recorded.ends.begin(), recorded.ends.end(), [&](std::size_t end) { return end <= length; }));
      if (whole == 0) {
        EXPECT_THAT(outcome.error, HasSubstr("cut.mkv")) << length;
        continue;
      }
      expect_first_frames(outcome, whole);
      EXPECT_THAT(outcome.warning, HasSubstr(closed ? "ends after " + std::to_string(whole) + " of 6 frames"
                                                    : "was never closed"))
          << length;
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  }
}

/// FFmpeg copies the number of frames of the whole; that is no damage. Its own duration counts.
TEST(DamagedLog, ALogThatAnotherToolCutIsWhole) {
  TemporaryFolder folder;
  LogWriter writer(folder / "a.mkv", {}, 25);
  for (const int i : {0, 1, 2, 5, 6, 9}) ASSERT_TRUE(writer.write(jpeg_frame(i)));
  writer.close();
  std::string bytes = read_bytes(folder / "a.mkv");
  bytes.replace(bytes.find("000000000006"), 12, "000000000025");
  write_bytes(folder / "ours.mkv", bytes);
  EXPECT_THAT(read_log(folder / "ours.mkv").warning, HasSubstr("6 of 25"));
  bytes.replace(bytes.find("gelslam"), 7, "Lavf59.");
  write_bytes(folder / "theirs.mkv", bytes);
  EXPECT_EQ(read_log(folder / "theirs.mkv").warning, "");
  write_bytes(folder / "theirs_cut.mkv", bytes.substr(0, bytes.size() * 6 / 10));
  EXPECT_THAT(read_log(folder / "theirs_cut.mkv").warning, HasSubstr("is it truncated or damaged?"));
}

TEST(DamagedLog, AHoleLosesOnlyWhatItHits) {
  TemporaryFolder folder;
  const Recorded recorded = record(folder / "a.mkv", 10, true);
  std::string bytes = recorded.bytes;
  const std::size_t from = recorded.ends[3] - 20,
                    to = recorded.ends[4] + 20;  // the end of 3, all of 4, the head of 5
  for (std::size_t i = from; i < to; ++i) bytes[i] = static_cast<char>(0x55);
  write_bytes(folder / "hole.mkv", bytes);
  const Outcome outcome = read_log(folder / "hole.mkv");
  EXPECT_EQ(outcome.error, "");
  ASSERT_GE(outcome.frames.size(), 7u);
  for (std::int64_t i = 0; i < 3; ++i)
    EXPECT_TRUE(outcome.frames[static_cast<std::size_t>(i)].bytes == jpeg_frame(i).bytes) << i;
  for (std::int64_t i = 6; i < 10; ++i) {
    const RawFrame& frame = outcome.frames[outcome.frames.size() - 10 + static_cast<std::size_t>(i)];
    EXPECT_EQ(frame.sequence, i) << "the sequence tells which are missing";
    EXPECT_NEAR(frame.time_s, 0.04 * static_cast<double>(i), 1e-6);
    EXPECT_TRUE(frame.bytes == jpeg_frame(i).bytes) << i;
  }
  EXPECT_THAT(outcome.warning, HasSubstr("of 10 frames; is it truncated or damaged?"));
}

/// Length fields one after another: those of elements in the header, found by their ids.
TEST(DamagedLog, HugeSizesCostNothing) {
  TemporaryFolder folder;
  const Recorded recorded = record(folder / "a.mkv", 3, true);
  const std::string ids[] = {
      "\x19\x41\xa4\x69", "\x61\xa7",         "\x46\x5c", "\x16\x54\xae\x6b", "\xae", "\x12\x54\xc3\x67",
      "\x44\x87",         "\x1f\x43\xb6\x75", "\xa1",     "\x75\xa1"};
  rusage before{}, after{};
  getrusage(RUSAGE_SELF, &before);
  for (const std::string& id : ids) {
    const std::size_t at = recorded.bytes.find(id);
    ASSERT_NE(at, std::string::npos);
    for (const std::string& length :
         {std::string("\x1f\xff\xff\xfe", 4), std::string("\x08\x7f\xff\xff\xff", 5),
          std::string("\x01\x7f\xff\xff\xff\xff\xff\xff", 8)}) {
      std::string bytes = recorded.bytes;
      bytes.replace(at + id.size(), 1, length);
      write_bytes(folder / "b.mkv", bytes);
      const Outcome outcome = read_log(folder / "b.mkv");
      EXPECT_LE(outcome.frames.size(), 3u);
    }
  }
  getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 200 * 1024) << "KiB";
}

TEST(FullDisk, StopsInWordsAndLeavesWhatWasWrittenReadable) {
  TemporaryFolder folder;
  const Recorded whole = record(folder / "whole.mkv", 10, true);
  for (const std::size_t limit : {whole.ends[4], whole.ends[4] + 1, whole.ends[4] + 40, whole.ends[5] - 1}) {
    const fs::path path = folder / (std::to_string(limit) + ".mkv");
    {
      const FileSizeLimit full(limit);
      LogWriter writer(path, kSomeAttachments, 25);
      int written = 0;
      while (written < 10 && writer.write(jpeg_frame(written))) ++written;
      EXPECT_EQ(written, 5);
      EXPECT_THAT(writer.failure(),
                  HasSubstr("recording stopped after 5 frames, still readable: File too large"));
      EXPECT_FALSE(writer.write(jpeg_frame(5)));
      writer.close();
    }
    EXPECT_EQ(fs::file_size(path), whole.ends[4]) << "nothing of the torn frame is left";
    const Outcome outcome = read_log(path);
    expect_first_frames(outcome, 5);
    EXPECT_EQ(outcome.warning, "") << "it was closed";
  }
}

TEST(FullDisk, NoRoomForTheHeaderLeavesNoFile) {
  TemporaryFolder folder;
  const FileSizeLimit full(100);
  {
    LogWriter writer(folder / "a.mkv", kSomeAttachments, 25);
    EXPECT_FALSE(writer.write(jpeg_frame(0)));
    EXPECT_THAT(writer.failure(), HasSubstr("after 0 frames"));
  }
  EXPECT_TRUE(folder.names().empty());
}

}  // namespace
}  // namespace gelslam::test
