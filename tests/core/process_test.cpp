#include "gelslam/core/process.hpp"

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
  for (const int second : {SIGINT, SIGTERM})
    EXPECT_EXIT(
        {
          const InterruptWatch watch;
          std::raise(SIGINT);
          std::raise(second);
        },
        testing::KilledBySignal(second), "");
}

TEST(InterruptWatch, EvenTheFirstSignalEndsWhatCannotBeStopped) {
  const InterruptWatch outer;
  EXPECT_EXIT(
      {
        const InterruptWatch watch(1, InterruptWatch::Ends::at_once);
        std::raise(SIGTERM);
      },
      testing::KilledBySignal(SIGTERM), "");
  { const InterruptWatch watch(1, InterruptWatch::Ends::at_once); }
  std::raise(SIGTERM);
  EXPECT_TRUE(outer.requested());
}

TEST(InterruptWatch, OneWithinAnotherTakesNoRequestFromIt) {
  const InterruptWatch outer(3);
  std::raise(SIGINT);
  {
    const InterruptWatch inner;
    EXPECT_FALSE(inner.requested());
    EXPECT_EQ(outer.requests(), 1);
    std::raise(SIGTERM);
    EXPECT_TRUE(inner.requested());
  }
  EXPECT_EQ(outer.requests(), 2);
  EXPECT_EQ(InterruptWatch::ended_early_by(), SIGINT);
  std::raise(SIGTERM);  // the third still asks
  EXPECT_EQ(outer.requests(), 3);
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

}  // namespace
}  // namespace gelslam
