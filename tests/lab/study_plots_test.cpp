#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "../support/data_folder.hpp"
#include "../support/run_program.hpp"
#include "study.hpp"

namespace gelslam {
namespace {

using namespace test;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const std::string kPython = "/usr/bin/python3";

bool can_draw() {
  static const bool can = run_program(kPython, {"-c", "import matplotlib"}).exit_code == 0;
  return can;
}

ProgramResult draw(const std::string& script, const std::vector<std::string>& arguments) {
  std::vector<std::string> all = {std::string(GELSLAM_SCRIPTS) + "/" + script};
  all.insert(all.end(), arguments.begin(), arguments.end());
  return run_program(kPython, all);
}

/// A folder for a study, that study, and what becomes of it.
struct Study {
  explicit Study(std::string study_name) : name(std::move(study_name)) {}

  nlohmann::json rows_of(const std::string& subcommand, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), subcommand);
    arguments.insert(arguments.end(), {"-o", path});
    const ProgramResult measured = run_program(GELSLAM_LAB, arguments);
    EXPECT_EQ(measured.exit_code, 0) << measured.err;
    return measured.exit_code == 0 ? nlohmann::json::parse(read_bytes(path + "/" + name + ".json"))
                                   : nlohmann::json::array();
  }
  void expect_picture() const {
    const ProgramResult drawn = draw("plot_" + name + ".py", {path});
    EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
    EXPECT_THAT(read_bytes(path + "/" + name + ".png"), StartsWith("\x89PNG"));
  }

  std::string name;
  TemporaryFolder folder;
  std::string path = (folder / "study").string();
};

const std::filesystem::path& coin() {
  static const std::filesystem::path folder = data_folder() / "sequences/track_coin";
  return folder;
}

TEST(StudyPlots, Stability) {
  if (!can_draw()) GTEST_SKIP() << "no matplotlib";
  Study study("stability");
  const auto rows = study.rows_of("stability", {"--quick", "--simulated-only", "--charts", "start x",
                                                "--methods", "normalflow,filterreg"});
  ASSERT_EQ(rows.size(), 8U);
  EXPECT_EQ(rows[0]["level"], 0.25);
  EXPECT_GT(rows[0]["right"], 0.8);
  EXPECT_EQ(rows[0]["silent_failures"], 0);
  EXPECT_EQ(rows[1]["method"], "filterreg");
  study.expect_picture();
}

TEST(StudyPlots, LongScan) {
  const std::filesystem::path model = data_folder() / "calibration_sim/model/nnmodel.pth";
  if (!std::filesystem::exists(model)) GTEST_SKIP() << "no data";
  if (!can_draw()) GTEST_SKIP() << "no matplotlib";
  Study study("long_scan");
  const auto rows = study.rows_of("long-scan", {"--frames", "100", "--to-and-fro", "30", "--size", "1",
                                                "--reports", "3", "--model", model.string()});
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows.back()["frames"], 110);  // and 10 of the background
  EXPECT_GE(rows.back()["keyframes"], 2);
  const auto summary = nlohmann::json::parse(read_bytes(study.path + "/long_scan_summary.json"))[0];
  EXPECT_EQ(summary["components"], 1);
  EXPECT_GT(summary["tracked_share"], 0.95);
  EXPECT_LT(summary["drift_mm"], 0.5);
  study.expect_picture();
}

TEST(StudyPlots, SpeedAgainstAccuracy) {
  if (!std::filesystem::is_directory(coin())) GTEST_SKIP() << "no data";
  if (!can_draw()) GTEST_SKIP() << "no matplotlib";
  Study study("speed_accuracy");
  const auto rows = study.rows_of("speed-accuracy", {coin().string(), "--methods", "normalflow,filterreg",
                                                     "--knobs", "samples", "--stride", "60", "--gaps", "1"});
  ASSERT_GT(rows.size(), 5U);
  EXPECT_EQ(rows[0]["knob"], "default");
  EXPECT_EQ(rows[0]["relative"], 1.0);
  EXPECT_EQ(rows[0]["problems"], 4);
  EXPECT_EQ(rows[1]["value"], "50");
  EXPECT_GT(rows[1]["relative"], 1.0) << "50 samples are less accurate than 3000";
  study.expect_picture();
}

TEST(StudyPlots, WithoutAStudyTheySayWhatWritesIt) {
  if (!can_draw()) GTEST_SKIP() << "no matplotlib";
  const TemporaryFolder folder;
  std::vector<std::string> arguments = {"-c", R"(import runpy, sys
scripts, study = sys.argv[1], sys.argv[2]
sys.path.insert(0, scripts)
for name in sys.argv[3:]:
    sys.argv = [f"{scripts}/plot_{name}.py", study]
    try:
        runpy.run_path(sys.argv[0], run_name="__main__")
    except SystemExit as end:
        print(f"plot_{name} ends with:", end.code, file=sys.stderr)
)",
                                        GELSLAM_SCRIPTS, folder.path().string()};
  const std::vector<std::string> names = {"stability", "speed_accuracy", "long_scan", "benchmark",
                                          "ablation"};
  arguments.insert(arguments.end(), names.begin(), names.end());
  const ProgramResult result =
      run_program(kPython, arguments);  // one process: matplotlib takes a second to load
  EXPECT_EQ(result.exit_code, 0);
  for (const std::string& name : names)
    EXPECT_THAT(result.err, testing::ContainsRegex("plot_" + name + " ends with: [^\n]*plot_" + name +
                                                   ": [^\n]*write it with"));
  EXPECT_THAT(result.err, Not(HasSubstr("Traceback")));
}

TEST(StudyPrograms, MistakesAreOneLine) {
  expect_mistake(run_program(GELSLAM_LAB, {"stability", "--simulated-only", "--methods", "icq"}),
                 "did you mean icp?", "gelslam-lab");
}

TEST(StudyCases, SayHowManyThereAreAndTheTimeLeft) {
  testing::internal::CaptureStderr();
  lab::StudyCases cases(2);
  cases.begin("coin");
  cases.begin("pebble");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "1/2  coin\n2/2  pebble, 0 s left\n");
}

}  // namespace
}  // namespace gelslam
