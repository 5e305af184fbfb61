#include "terminal_progress.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <sstream>
#include <thread>

namespace gelslam {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(ProgressLine, SaysHowFarHowFastAndHowLong) {
  EXPECT_EQ(progress_line("tracking", 120, 240, 4.0, 80),
            "tracking  [############............]  50%  120/240  30/s  4 s left");
  EXPECT_EQ(progress_line("fusing", 1, 1000, 2.0, 80),
            "fusing  [........................]  0%  1/1000  0.5/s  33:18 min left");
  EXPECT_EQ(progress_line("simplifying", 4, 10, 200.0, 80),
            "simplifying  [#########...............]  40%  4/10  5:00 min left");
  EXPECT_EQ(progress_line("tracking", 240, 240, 8.0, 80),
            "tracking  [########################]  100%  240/240  30/s");
  EXPECT_EQ(progress_line("closing loops", 0, 60, 7.0, 80),
            "closing loops  [........................]  0%  0/60  7 s");
  EXPECT_EQ(progress_line("reading", 50, std::nullopt, 2.0, 80), "reading  50  25/s");
  EXPECT_EQ(progress_line("closing loops", 0, std::nullopt, 75.0, 80), "closing loops  1:15 min");
}

TEST(ProgressLine, StrangeNumbersStayInBounds) {
  EXPECT_EQ(progress_line("t", 0, 0, 0.0, 80), "t  0");
  EXPECT_THAT(progress_line("t", 300, 240, 1.0, 80), HasSubstr("100%  300/240"));
  EXPECT_THAT(progress_line("t", 300, 240, 1.0, 80), Not(HasSubstr("left")));
  EXPECT_LE(progress_line("t", 1, INT64_MAX, 1e9, 200).size(), 200u);
  EXPECT_EQ(progress_line("tracking", 1, 2, 1.0, 5), "track");
  EXPECT_EQ(progress_line("tracking", 1, 2, 1.0, -3).size(), 1u);
}

TEST(TerminalProgress, DrawsAtMostTenTimesASecondAndEndsTheLine) {
  std::ostringstream out;
  double now_s = 100.0;
  {
    TerminalProgress progress(out, 80, [&] { return now_s; });
    progress.begin("tracking", 1000);
    for (int i = 1; i <= 1000; ++i) {
      now_s += 0.001;
      progress.update(i);
    }
    progress.end();
    progress.end();
  }
  const std::string text = out.str();
  EXPECT_LE(std::count(text.begin(), text.end(), '\r'), 12);
  EXPECT_GE(std::count(text.begin(), text.end(), '\r'), 9);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
  EXPECT_THAT(text, EndsWith("100%  1000/1000  1000/s\x1b[K\n"));
}

TEST(TerminalProgress, TimeGoesOnWhileTheWorkSaysNothing) {
  std::ostringstream out;
  std::atomic<double> now_s = 0;
  {
    TerminalProgress progress(
        out, 80, [&] { return now_s.load(); }, /*ticks=*/true);
    progress.begin("closing loops", std::nullopt);
    now_s = 7;
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    now_s = 9;
  }
  EXPECT_THAT(out.str(), HasSubstr("closing loops  7 s"));
  EXPECT_THAT(out.str(), EndsWith("closing loops  9 s\x1b[K\n"));
}

TEST(TerminalProgress, AnAbandonedTaskEndsItsLine) {
  std::ostringstream out;
  {
    TerminalProgress(out, 80, [] { return 0.0; }).begin("tracking", std::nullopt);
  }
  EXPECT_THAT(out.str(), EndsWith("\n"));
  std::ostringstream nothing;
  {
    TerminalProgress(nothing, 80, [] { return 0.0; }).update(5);
  }
  EXPECT_EQ(nothing.str(), "");
}

}  // namespace
}  // namespace gelslam
