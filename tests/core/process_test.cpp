#include "gelslam/core/process.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <thread>

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

TEST(InterruptWatch, SaysBySignalWhatEndedTheWorkEarly) {
  {
    const InterruptWatch watch;
    EXPECT_EQ(InterruptWatch::ended_early_by(), 0);
    std::raise(SIGTERM);
  }
  EXPECT_EQ(InterruptWatch::ended_early_by(), SIGTERM);
  const InterruptWatch camera(1, InterruptWatch::Ends::regularly);
  { const InterruptWatch while_it_is_opened; }
  std::raise(SIGINT);
  EXPECT_TRUE(camera.requested());
  EXPECT_EQ(InterruptWatch::ended_early_by(), 0);
}

TEST(LowerThreadPriority, IsRelativeToWhatTheThreadHas) {
  const auto lowered_from = [](int nice_value) {
    int lowered = 0;
    std::thread([&] {
      ::setpriority(PRIO_PROCESS, 0, nice_value);
      lower_thread_priority();
      lowered = ::getpriority(PRIO_PROCESS, 0);
    }).join();
    return lowered;
  };
  const int now = ::getpriority(PRIO_PROCESS, 0);
  if (now > 5) GTEST_SKIP() << "this test runs at nice " << now << " already";
  EXPECT_EQ(lowered_from(now), now + 10);
  EXPECT_EQ(lowered_from(7), 17);
  EXPECT_EQ(lowered_from(15), 19);
  EXPECT_EQ(::getpriority(PRIO_PROCESS, 0), now) << "only the thread that asks";
}

}  // namespace
}  // namespace gelslam
