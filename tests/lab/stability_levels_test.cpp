#include "stability_levels.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "../support/data_folder.hpp"
#include "simulated_frames.hpp"

namespace gelslam::lab {
namespace {

std::vector<StabilityLevel> levels_of(const std::vector<std::string>& charts) {
  std::vector<StabilityLevel> levels;
  static TouchStudio studio(simulated_frames().model);
  const StabilityChoice choice{1, 2, false, charts};
  simulated_levels(studio, choice, [&](const StabilityLevel& level) { levels.push_back(level); });
  return levels;
}

TEST(StabilityLevels, StartsAreAsFarOffAsTheLevelSays) {
  std::set<std::string> charts;
  for (const StabilityLevel& level : levels_of({"start y", "start rz", "start"})) {
    charts.insert(level.chart);
    EXPECT_THAT(stability_charts(), testing::Contains(level.chart));
    EXPECT_TRUE(is_basin(level.chart));
    EXPECT_EQ(level.set.problems.size(), 2 * level.set.references.size());
    std::set<bool> signs;
    for (const RegistrationProblem& problem : level.set.problems) {
      const Pose gap = problem.start * problem.truth.inverse();
      const double mm = level.chart == "start rz" ? 0 : level.level;
      const double deg = level.chart == "start y" ? 0
                         : level.chart == "start" ? 10 * level.level
                                                  : level.level;
      EXPECT_NEAR(gap.translation().norm(), mm, 1e-9);
      EXPECT_NEAR(rotation_angle_rad(gap) * 180 / M_PI, deg, 1e-6);
      if (level.chart == "start y") {
        EXPECT_NEAR(std::abs(gap.translation().y()), mm, 1e-9);
      }
      if (level.chart == "start rz") {
        EXPECT_NEAR(std::abs(so3_log(gap.linear()).z()) * 180 / M_PI, deg, 1e-6);
      }
      signs.insert(gap.translation().y() + so3_log(gap.linear()).z() > 0);
    }
    EXPECT_EQ(signs.size(), 2U) << level.chart << " " << level.level;
  }
  EXPECT_EQ(charts.size(), 3U);
}

TEST(StabilityLevels, MissingFramesStartFromTheReference) {
  const std::filesystem::path coin = test::data_folder() / "sequences/track_coin";
  if (!std::filesystem::is_directory(coin)) GTEST_SKIP() << "no data";
  std::set<double> gaps;
  missing_frame_levels({coin}, {1, 1, false, {}}, [&](const StabilityLevel& level) {
    gaps.insert(level.level);
    for (const RegistrationProblem& problem : level.set.problems) {
      EXPECT_TRUE(problem.start.isApprox(Pose::Identity()));
      EXPECT_EQ(problem.gap, level.level);
      EXPECT_GT(problem.truth.translation().norm(), 1e-4);
      EXPECT_LT(problem.truth.translation().norm(), 0.3 * level.level);  // a hand's speed
    }
  });
  EXPECT_EQ(gaps, (std::set<double>{1, 4, 12}));
}

}  // namespace
}  // namespace gelslam::lab
