#include "gelslam/core/stage_timer.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace gelslam
