#include "protocols/report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "../support/analytic_surface.hpp"
#include "../support/temporary_folder.hpp"

namespace gelslam {
namespace {

using namespace test;
using testing::HasSubstr;

/// A frame whose estimate is off by the given slide and twist from a truth of 1 mm and 10 degrees.
FrameEstimate off_by(int frame, double x_mm, double twist_deg, double ms, bool tracked = true) {
  FrameEstimate estimate;
  estimate.frame = frame;
  estimate.tracked = tracked;
  estimate.true_first_T_frame = motion(0, 0, 10, 1, 0, 0);
  estimate.first_T_frame = motion(0, 0, 10 + twist_deg, 1 + x_mm, 0, 0);
  estimate.cpu_ms = ms;
  return estimate;
}

BenchmarkResult two_methods() {
  BenchmarkResult result;
  result.records = {
      {"a", "bead", "bead1", {off_by(5, 0, 0, 9), off_by(6, 0.2, 1, 1), off_by(7, -0.4, -2, 2)}},
      {"b", "bead", "bead1", {off_by(5, 0, 0, 9), off_by(6, 1, 0, 30, false), off_by(7, 1, 0, 50)}},
      {"a", "bead", "bead2", {off_by(3, 0, 0, 9), off_by(4, 0.6, 3, 4)}},
      {"a", "key, brass", "key1", {off_by(0, 0, 0, 9), off_by(1, 0, 350, 8)}}};
  return result;
}

TEST(Accuracy, IsTheMeanAbsoluteErrorOverAllFramesOfAnObject) {
  const auto rows = accuracy_by_object(two_methods());
  ASSERT_EQ(rows.size(), 5U);
  const AccuracyRow& a = rows[0];
  EXPECT_EQ(a.method, "a");
  EXPECT_EQ(a.object, "bead");
  EXPECT_EQ(a.trial, "all");
  EXPECT_EQ(a.trials, 2);
  EXPECT_EQ(a.frames, 5);
  EXPECT_NEAR(a.mae[0], (0.2 + 0.4 + 0.6) / 5, 1e-9);
  EXPECT_NEAR(a.mae[5], (1.0 + 2 + 3) / 5, 1e-9);
  EXPECT_NEAR(a.mae[1], 0, 1e-9);
  EXPECT_NEAR(a.final_mm, 0.5 * (0.4 + 0.6), 1e-9);
  EXPECT_NEAR(a.final_deg, 0.5 * (2 + 3), 1e-6);
  EXPECT_EQ(a.median_ms, 2) << "the first frame of a trial is not registered";
  EXPECT_EQ(rows[1].method, "b");
  EXPECT_EQ(rows[1].trial, "bead1");
  EXPECT_NEAR(rows[1].tracked_share(), 2.0 / 3, 1e-9);
  EXPECT_EQ(rows[2].object, "key, brass");
  EXPECT_NEAR(rows[2].mae[5], 10.0 / 2, 1e-6) << "350 degrees off are 10 degrees off";
  EXPECT_EQ(rows[3].object, "all");
  EXPECT_EQ(rows[3].frames, 7);
  EXPECT_EQ(accuracy_by_trial(two_methods()).size(), 4U);
}

TEST(Accuracy, GeometricMeanCountsADegreeAs87Micrometers) {
  FrameEstimate frame;
  frame.first_T_frame = motion(0, 0, 2, 0.1, 0.2, 0.3);
  frame.first_T_frame.linear() =  // Ry Rx Rz
      so3_exp({0, 1 * kDegree, 0}) * so3_exp({1 * kDegree, 0, 0}) * so3_exp({0, 0, 2 * kDegree});
  BenchmarkResult result;
  result.records.push_back({"a", "o", "t", {frame}});
  EXPECT_NEAR(accuracy_by_object(result).at(0).geometric_mean_mm,
              std::pow(0.1 * 0.2 * 0.3 * 1 * 1 * 2 * std::pow(0.087, 3), 1.0 / 6), 1e-9);
}

TEST(ErrorBands, AreOverTrialsAtTheSameTimeSinceContact) {
  const auto bands = error_bands(two_methods());
  const auto at = [&](const std::string& method, const std::string& object, int frame) {
    for (const ErrorBand& band : bands)
      if (band.method == method && band.object == object && band.frame == frame) return band;
    ADD_FAILURE() << method << " " << object << " " << frame;
    return ErrorBand{};
  };
  const ErrorBand one = at("a", "bead", 1);  // 0.2 and 0.6
  EXPECT_EQ(one.trials, 2);
  EXPECT_NEAR(one.mean[0], 0.4, 1e-9);
  EXPECT_NEAR(one.deviation[0], 0.2, 1e-9);
  EXPECT_EQ(at("a", "bead", 2).trials, 1);
  EXPECT_EQ(at("a", "all", 1).trials, 3);
}

TEST(RuntimeHistogram, CountsEveryRegisteredFrameOnce) {
  int frames = 0;
  for (const RuntimeBin& bin : runtime_histogram(two_methods())) {
    EXPECT_NEAR(bin.high_ms / bin.low_ms, std::pow(10, 1.0 / 8), 1e-9);
    if (bin.method == "a") frames += bin.frames;
    if (bin.method == "b" && bin.frames > 0) {
      EXPECT_TRUE((bin.low_ms <= 30 && 30 < bin.high_ms) || (bin.low_ms <= 50 && 50 < bin.high_ms));
    }
  }
  EXPECT_EQ(frames, 4);
}

TEST(WriteBenchmark, WritesWhatReadersUnderstand) {
  const TemporaryFolder folder;
  write_benchmark(folder.path(), two_methods());
  std::vector<std::string> expected = benchmark_files();
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(folder.names(), expected);
  const auto json = nlohmann::json::parse(read_bytes(folder / "benchmark.json"));
  EXPECT_EQ(json["protocol"], "frame0");
  EXPECT_EQ(json["partial"], false);
  EXPECT_NEAR(json["accuracy"][0]["mae"]["x_mm"].get<double>(), 0.24, 1e-9);
  EXPECT_THAT(read_bytes(folder / "accuracy.csv"), HasSubstr("\na,\"key, brass\",key1,1,2,"));
  const std::string frames = read_bytes(folder / "frames.csv");
  EXPECT_EQ(std::count(frames.begin(), frames.end(), '\n'), 1 + 3 + 3 + 2 + 2);
  EXPECT_THAT(to_table(two_methods()), HasSubstr("key, brass"));
}

TEST(WriteBenchmark, TakesAResultWithoutAnything) {
  const TemporaryFolder folder;
  write_benchmark(folder.path(), {});
  EXPECT_EQ(folder.names().size(), benchmark_files().size());
}

}  // namespace
}  // namespace gelslam
