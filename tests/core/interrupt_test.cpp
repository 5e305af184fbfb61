#include "gelslam/core/interrupt.hpp"

#include <gtest/gtest.h>

namespace gelslam {
namespace {

TEST(InterruptWatch, FirstSignalAsks) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const InterruptWatch watch;
    EXPECT_FALSE(watch.requested());
    std::raise(signal);
    EXPECT_TRUE(watch.requested());
  }
}

TEST(InterruptWatch, SecondSignalEndsTheProgram) {
  EXPECT_EXIT(
      {
        const InterruptWatch watch;
        std::raise(SIGINT);
        std::raise(SIGINT);
      },
      testing::KilledBySignal(SIGINT), "");
  EXPECT_EXIT(
      {
        const InterruptWatch watch;
        std::raise(SIGINT);
        std::raise(SIGTERM);
      },
      testing::KilledBySignal(SIGTERM), "");
}

TEST(InterruptWatch, AsksAsOftenAsToldThenEndsTheProgram) {
  EXPECT_EXIT(
      {
        const InterruptWatch watch(2);
        std::raise(SIGINT);
        std::raise(SIGTERM);
        if (watch.requests() == 2) std::raise(SIGINT);
      },
      testing::KilledBySignal(SIGINT), "");
}

TEST(InterruptWatch, AClosedTerminalAsksOnceUnlessItIsToBeOutlived) {
  {
    const InterruptWatch watch;
    std::raise(SIGHUP);
    std::raise(SIGHUP);
    EXPECT_EQ(watch.requests(), 1);
  }
  const auto previous = std::signal(SIGHUP, SIG_IGN);  // nohup
  {
    const InterruptWatch watch;
    std::raise(SIGHUP);
    EXPECT_FALSE(watch.requested());
  }
  std::signal(SIGHUP, previous);
}

TEST(InterruptWatch, GivesBackWhatWasThere) {
  const auto previous = std::signal(SIGINT, SIG_IGN);
  { const InterruptWatch watch; }
  std::raise(SIGINT);  // ignored again, else the test ends here
  EXPECT_EQ(std::signal(SIGINT, previous), SIG_IGN);
}

}  // namespace
}  // namespace gelslam
