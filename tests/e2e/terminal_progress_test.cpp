#include "terminal_progress.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

namespace gelslam {
namespace {

using ::testing::EndsWith;

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

}  // namespace
}  // namespace gelslam
