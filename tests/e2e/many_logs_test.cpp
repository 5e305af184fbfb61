// gelslam reconstruct with several logs: one process and one run folder each.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "../support/run_program.hpp"
#include "simulated_scan.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using namespace test;
using testing::ContainsRegex;
using testing::HasSubstr;

/// The table's line of a log; its words.
std::string line_of(const std::string& table, const std::string& log) {
  for (const std::string& line : lines_of(table))
    if (line.starts_with(log + " ")) return line;
  return "no line of " + log;
}

json report_of(const fs::path& run) { return json::parse(read_bytes(run / "report.json")); }

TEST(ManyLogs, EachBecomesARunAndABrokenOneStopsNone) {
  const TemporaryFolder folder;
  const std::string model = scan().model().string(), runs = (folder / "runs").string();
  fs::copy(scan().log(), folder / "first");
  fs::copy(scan().log() / "gelsight.avi", folder / "-second.avi");
  write_bytes(folder / "broken.avi", "no video");
  const std::vector<std::string> words = {"reconstruct",
                                          "--jobs",
                                          "2",
                                          "-o",
                                          runs,
                                          "--model",
                                          model,
                                          "--",
                                          (folder / "first/").string() + "/",
                                          (folder / "broken.avi").string(),
                                          (folder / "-second.avi").string()};
  const ProgramResult result = gelslam(words);
  EXPECT_EQ(result.exit_code, 2) << "that of the worst log";
  EXPECT_THAT(result.err, HasSubstr("3 logs, 2 at a time\n"));
  EXPECT_THAT(line_of(result.out, "broken"), ContainsRegex("- +- +- +- +- +-  failed: .*broken.avi: "));
  for (const char* name : {"first", "-second"}) {
    expect_complete(folder / "runs" / name);
    const json report = report_of(folder / "runs" / name);
    EXPECT_EQ(report.at("model"), fs::absolute(model).string());
    const std::string figures = std::to_string(report.at("frames").at("total").get<int>()) + " +" +
                                std::to_string(report.at("frames").at("in_map").get<int>()) + " +1 +" +
                                std::to_string(report.at("keyframes").get<int>());
    EXPECT_THAT(line_of(result.out, name), ContainsRegex(figures));
  }
  EXPECT_TRUE(read_bytes(folder / "runs/first/mesh.ply") == read_bytes(folder / "runs/-second/mesh.ply"))
      << "one log, told by two names, with one model";

  const std::string before = read_bytes(folder / "runs/first/report.json");  // it says how long it took
  const ProgramResult again = gelslam(words);
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("1 log, 1 at a time\n"));
  EXPECT_THAT(line_of(again.out, "first"),
              HasSubstr("finished before (with the settings of then; --overwrite"));
  EXPECT_EQ(read_bytes(folder / "runs/first/report.json"), before);
}

TEST(ManyLogs, ArgumentsThatCannotBeMeantAreRefused) {
  const TemporaryFolder folder;
  const std::string log = scan().log().string(), video = (scan().log() / "gelsight.avi").string();
  const std::string runs = (folder / "runs").string();
  fs::create_directories(folder / "other/scan");
  expect_mistake(gelslam({"reconstruct", log, log + "/", "-o", runs}), log + "/: is given twice");
  expect_mistake(gelslam({"reconstruct", log, (folder / "other/scan").string(), "-o", runs}),
                 "would both go to " + runs + "/scan; rename one");
  expect_mistake(gelslam({"reconstruct", log, video, "-o", runs}), "would both go to");
  expect_mistake(gelslam({"reconstruct", log, "-o", runs, "--jobs", "0"}), "--jobs");
  expect_mistake(gelslam({"reconstruct", log, "", "-o", runs}), "has no name");
  expect_mistake(gelslam({"reconstruct", log, "-o", video, "--jobs", "1"}), video + ": is a file");
  write_bytes(folder / "other/report.json", "{}");
  expect_mistake(gelslam({"reconstruct", log, "-o", (folder / "other").string(), "--jobs", "1"}),
                 (folder / "other").string() + ": is a run; name a folder for the runs of several logs");
  EXPECT_FALSE(fs::exists(runs));
}

TEST(ManyLogs, StoppedItSaysWhatIsDoneAndGoesOnWhenRepeated) {
  const TemporaryFolder folder;
  write_long_log(folder / "long", 150);
  fs::copy(scan().log(), folder / "short");
  const std::vector<std::string> words = {"reconstruct",
                                          (folder / "long").string(),
                                          (folder / "short").string(),
                                          "--jobs",
                                          "1",
                                          "--model",
                                          scan().model().string(),
                                          "-o",
                                          (folder / "runs").string()};
  const pid_t child = start_program(words, folder / "table");
  const auto begun = [&] {
    std::error_code code;
    const fs::directory_iterator entry(folder / "runs", code);
    return !code && entry != fs::directory_iterator();
  };
  while (!begun()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  ::kill(child, SIGINT);
  EXPECT_EQ(exit_code_of(child), 128 + SIGINT);
  const std::string table = read_bytes(folder / "table");
  EXPECT_THAT(line_of(table, "long"), HasSubstr("stopped early"));
  EXPECT_THAT(line_of(table, "short"), HasSubstr("not started"));
  EXPECT_EQ(report_of(folder / "runs/long").at("partial"), true);

  const ProgramResult again = gelslam(words);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(report_of(folder / "runs/long").at("frames").at("total"), 150);
  EXPECT_EQ(report_of(folder / "runs/long").at("partial"), false);
  expect_complete(folder / "runs/short");
}

}  // namespace
}  // namespace gelslam
