#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <thread>

#include "../support/killed_process.hpp"
#include "../support/temporary_folder.hpp"
#include "raw_frames.hpp"

namespace gelslam {
namespace {

/// Writes frames until it is killed.
void write_for_ever(const std::filesystem::path& path, const std::vector<RawFrame>& frames,
                    const std::function<void()>& tell) {
  LogWriter writer(path, {"sensor", "", "a: 1\n", std::string(12000, 'm')}, 25);
  for (std::size_t i = 0;; ++i) {
    RawFrame frame = frames[i % frames.size()];
    frame.sequence = static_cast<std::int64_t>(i);
    frame.time_s = 0.04 * static_cast<double>(i);
    if (!writer.write(frame)) return;
    tell();
  }
}

/// Fifty times, at random moments; GELSLAM_KILLS for more.
TEST(KilledRecording, NothingWrittenBeforeTheKillIsLost) {
  std::vector<RawFrame> frames;
  for (int i = 0; i < 5; ++i) frames.push_back(test::jpeg_frame(i, 320, 240));
  const char* wanted = std::getenv("GELSLAM_KILLS");
  const int kills = wanted != nullptr ? std::atoi(wanted) : 50;
  std::mt19937 random(std::random_device{}());
  int most = 0;
  for (int round = 0; round < kills; ++round) {
    const test::TemporaryFolder folder;
    const std::filesystem::path path = folder / "a.mkv";
    test::KilledProcess recorder([&](const auto& tell) { write_for_ever(path, frames, tell); });
    recorder.wait_for_step();
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 20000));
    const int written = recorder.kill();

    const auto log = open_raw_log(path);
    int read = 0;
    while (const std::optional<RawFrame> frame = log->next()) {
      ASSERT_EQ(frame->sequence, read);
      ASSERT_TRUE(frame->bytes == frames[static_cast<std::size_t>(read) % frames.size()].bytes) << read;
      ++read;
    }
    ASSERT_GE(read, written) << "round " << round;
    ASSERT_LE(read, written + 1) << "one may have been written and not yet counted";
    EXPECT_EQ(read_log_attachments(path).model.size(), 12000u);
    EXPECT_NE(log->warning().find("was never closed"), std::string::npos) << log->warning();
    most = std::max(most, read);
  }
  EXPECT_GT(most, 10) << "too short to mean anything";
}

}  // namespace
}  // namespace gelslam
