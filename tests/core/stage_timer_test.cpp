#include "gelslam/core/stage_timer.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace gelslam {
namespace {

TEST(StageTimer, StatisticsOfKnownTimes) {
  StageTimer timer;
  for (int i = 100; i >= 1; --i) timer.add("track", i);
  timer.add("fuse", 7.5);
  const auto statistics = timer.statistics();
  ASSERT_EQ(statistics.size(), 2u);
  EXPECT_EQ(statistics[0].stage, "track");
  EXPECT_EQ(statistics[0].count, 100);
  EXPECT_EQ(statistics[0].median_ms, 51);
  EXPECT_EQ(statistics[0].p99_ms, 99);
  EXPECT_EQ(statistics[0].max_ms, 100);
  EXPECT_EQ(statistics[0].total_ms, 5050);
  EXPECT_EQ(statistics[1].stage, "fuse");
  EXPECT_EQ(statistics[1].median_ms, 7.5);
  EXPECT_TRUE(StageTimer().statistics().empty());
  StageTimer odd;
  for (const double ms : {3.0, 1.0, 2.0}) odd.add("s", ms);
  EXPECT_EQ(odd.statistics()[0].median_ms, 2.0);
  EXPECT_EQ(odd.statistics()[0].p99_ms, 3.0);
}

TEST(StageTimer, MedianForgetsWhatIsOldButCountAndMaxDoNot) {
  StageTimer timer;
  timer.add("s", 1000.0);
  for (std::size_t i = 0; i < StageTimer::kKeptSamples; ++i) timer.add("s", 1.0);
  for (std::size_t i = 0; i < StageTimer::kKeptSamples; ++i) timer.add("s", 2.0);
  const StageStatistics s = timer.statistics().at(0);
  EXPECT_EQ(s.median_ms, 2.0);
  EXPECT_EQ(s.p99_ms, 2.0);
  EXPECT_EQ(s.max_ms, 1000.0);
  EXPECT_EQ(s.count, static_cast<std::int64_t>(2 * StageTimer::kKeptSamples + 1));
  EXPECT_EQ(s.total_ms, 1000.0 + 3.0 * StageTimer::kKeptSamples);
}

TEST(StageTimer, ThreadsDoNotLoseSamples) {
  StageTimer timer;
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < 4; ++t) {
      threads.emplace_back([&timer] {
        for (int i = 0; i < 10000; ++i) timer.add(i % 2 == 0 ? "even" : "odd", 1.0);
      });
    }
  }
  for (const StageStatistics& s : timer.statistics()) EXPECT_EQ(s.count, 20000);
}

}  // namespace
}  // namespace gelslam
