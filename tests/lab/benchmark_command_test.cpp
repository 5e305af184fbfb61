#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "../support/run_program.hpp"
#include "public_trial.hpp"

namespace gelslam {
namespace {

using namespace test;
using testing::HasSubstr;

ProgramResult benchmark(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "benchmark");
  return run_program(GELSLAM_LAB, arguments);
}

void expect_lab_mistake(const ProgramResult& result, const std::string& words) {
  expect_mistake(result, words, "gelslam-lab");
}

TEST(BenchmarkCommand, ComparesMethodsOnThePublicLayout) {
  const TemporaryFolder data;
  write_public_trial(data / "set/bead1", 6);
  write_public_trial(data / "set/bead2", 5, {2});
  const std::string set = (data / "set").string(), out = (data / "out").string();
  const ProgramResult result = benchmark({set, "--methods", "normalflow,icp,filterreg", "-o", out});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("filterreg"));
  const auto table = nlohmann::json::parse(read_bytes(data / "out/accuracy.json"));
  ASSERT_EQ(table.size(), 3U);
  for (const auto& row : table) {
    EXPECT_EQ(row["object"], "bead");
    EXPECT_EQ(row["frames"], 10);
    EXPECT_LT(row["x_mm"].get<double>(), row["method"] == "normalflow" ? 0.02 : 0.15);
  }
  EXPECT_EQ(benchmark({set, "--methods", "icp", "--protocol", "keyframes"}).exit_code, 0);
}

TEST(ReproducePaper, PrintsPublishedErrorsBesideOurs) {
  const TemporaryFolder data;
  write_public_trial(data / "set/bead0", 4);
  write_public_trial(data / "set/ball0", 4);
  // Older data name the truth otherwise, and keep gradients in half precision.
  std::filesystem::rename(data / "set/ball0/true_start_T_currs.npy", data / "set/ball0/true_transforms.npy");
  halve_precision(data / "set/ball0/gradient_maps.npy");
  const std::string set = (data / "set").string(), out = (data / "out").string();
  const std::string bin = std::filesystem::path(GELSLAM_LAB).parent_path().string(),
                    script = GELSLAM_SCRIPTS "/reproduce_paper.sh";
  const ProgramResult result = run_program(
      "/usr/bin/env", {"GELSLAM_BIN=" + bin, script, "--methods", "normalflow,icp", "-o", out, set});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("normalflow, all 2"));
  EXPECT_THAT(result.out, HasSubstr("normalflow, 1 without ball and cylinder"));
  EXPECT_THAT(result.out, HasSubstr("icp, published                                1.220    3.440"));
  EXPECT_EQ(run_program("/usr/bin/env", {"GELSLAM_BIN=" + bin, script, "-o", out, "/nowhere"}).exit_code, 2);
}

TEST(BenchmarkCommand, MistakesAreOneLine) {
  const TemporaryFolder data;
  write_public_trial(data / "bead1", 1);
  const std::string folder = data.path().string();
  expect_lab_mistake(benchmark({}), "DATA is required");
  expect_lab_mistake(benchmark({folder, "--methods", "icq"}), "did you mean icp?");
  expect_lab_mistake(benchmark({folder, "--protocol", "frame1"}), "protocol");
  expect_lab_mistake(benchmark({(data / "none").string()}), "there is no such folder");
  write_bytes(data / "bead1/contact_masks.npy", "torn");
  const ProgramResult torn = benchmark({folder});
  EXPECT_EQ(torn.exit_code, 2);
  EXPECT_THAT(torn.err, HasSubstr("bead1/contact_masks.npy: not a usable .npy"));
}

}  // namespace
}  // namespace gelslam
