#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "speed_accuracy.hpp"

namespace gelslam::lab {
namespace {

constexpr int kSequences = 3, kReferences = 20, kPairs = 3;

/// A degree counts as 0.087 mm: with these six errors the geometric mean is `mm`.
SixAxes errors_of(double mm) { return {mm, mm, mm, mm / 0.087, mm / 0.087, mm / 0.087}; }

/// Problems differ: by sequence tenfold, by reference up to twofold; all settings find the same ones hard.
double hardness(int sequence, int reference) {
  return 0.001 * std::pow(10, sequence) * (1 + reference % 5 / 4.0);
}

/// `factor(sequence, reference)` times as far off as the base; `every`: reference that is looked at.
template <class Factor>
ParetoCandidate candidate(double time_ms, const Factor& factor, int every = 1) {
  ParetoCandidate made{time_ms, {}};
  for (int s = 0; s < kSequences; ++s) {
    made.errors.emplace_back(kReferences);
    for (int r = 0; r < kReferences; r += every)
      for (int pair = 0; pair < kPairs; ++pair)
        made.errors.back()[static_cast<std::size_t>(r)].push_back(errors_of(hardness(s, r) * factor(s, r)));
  }
  return made;
}

ParetoCandidate constant(double time_ms, double factor, int every = 1) {
  return candidate(
      time_ms, [=](int, int) { return factor; }, every);
}

TEST(Pareto, ErrorsAreRelativeToTheBaseOnTheSameProblems) {
  // The slow one sees every fifth reference, the easiest; it is judged by those.
  const auto standings = pareto_standings({constant(1, 1), constant(2, 0.5), constant(9, 2, 5)}, 0);
  EXPECT_DOUBLE_EQ(standings[0].relative, 1);
  EXPECT_NEAR(standings[1].relative, 0.5, 1e-12);
  EXPECT_NEAR(standings[2].relative, 2, 1e-12);
  for (const ParetoStanding& standing : standings) {  // what is hard for all leaves no doubt
    EXPECT_NEAR(standing.relative_low, standing.relative, 1e-12);
    EXPECT_NEAR(standing.relative_high, standing.relative, 1e-12);
  }
  // Of the base: mean over references of 1 .. 2, geometric mean of 0.001, 0.01 and 0.1 over sequences.
  EXPECT_NEAR(standings[0].error_mm, 0.01 * 1.5, 1e-12);
  EXPECT_NEAR(standings[2].error_mm, 0.01 * 2, 1e-12);
}

TEST(Pareto, TheFrontIsWhatNothingIsFasterAndBetterThan) {
  const auto standings = pareto_standings(
      {constant(2, 1), constant(1, 3), constant(3, 0.9), constant(4, 0.95), constant(1.5, 1), constant(3, 2)},
      0);
  const bool on_front[] = {false, true, true, false, true, false};
  for (std::size_t k = 0; k < 6; ++k) EXPECT_EQ(standings[k].on_front, on_front[k]) << k;
}

TEST(Pareto, TheDrawsSayHowSureADifferenceIs) {
  std::mt19937_64 random(7);
  const auto noisy = [&](double mean) {
    return [&random, mean](int, int) { return mean * (0.5 + static_cast<double>(random() % 1000) / 1000); };
  };
  // 60 references of +-29 % each: the mean is known to 4 %.
  const ParetoCandidate alike = candidate(1, noisy(0.98)), better = candidate(1, noisy(0.8));
  const auto standings = pareto_standings({constant(2, 1), alike, better}, 0);
  for (const std::size_t k : {1U, 2U}) {
    EXPECT_GT(standings[k].relative_high - standings[k].relative_low, 0.06);
    EXPECT_LT(standings[k].relative_high - standings[k].relative_low, 0.25);
  }
  EXPECT_LT(standings[1].relative_low, 1);
  EXPECT_GT(standings[1].relative_high, 1);
  EXPECT_LT(standings[2].relative_high, 1);
}

TEST(Pareto, ExactAnswersAndMissingOnesLeaveNumbers) {
  ParetoCandidate blind{1, GroupedErrors(kSequences, std::vector<std::vector<SixAxes>>(kReferences))};
  for (const ParetoStanding& standing : pareto_standings({constant(1, 1), constant(1, 0), blind}, 0))
    for (const double number :
         {standing.error_mm, standing.relative, standing.relative_low, standing.relative_high})
      EXPECT_TRUE(std::isfinite(number));
}

}  // namespace
}  // namespace gelslam::lab
