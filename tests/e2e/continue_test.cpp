// Scans that are continued, also after kill -9, and joined.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>
#include <random>

#include "../support/database.hpp"
#include "../support/run_program.hpp"
#include "simulated_scan.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using namespace test;
using nlohmann::json;
using testing::HasSubstr;

constexpr int kFrames = kBackgroundFrames + kScanFrames;

std::vector<std::string> replay_all(const std::vector<std::string>& more) {
  std::vector<std::string> arguments{"scan",    scan().log().string(),  "--headless", "--every-frame",
                                     "--model", scan().model().string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

json report_of(const fs::path& run) { return json::parse(read_bytes(run / "report.json")); }

/// An offline run loses nothing, either.
TEST(KilledScan, OfALogThatIsReconstructedIsFused) {
  const TemporaryFolder folder;
  write_long_log(folder / "log", 600);
  const std::string run = (folder / "run").string();
  const pid_t process = start_program(GELSLAM_PROGRAM, {"reconstruct", (folder / "log").string(), "--model",
                                                        scan().model().string(), "-o", run, "-q"});
  const auto keyframes = [&] {
    return fs::exists(run + "/session.db")
               ? std::stoi(sql(run + "/session.db", "SELECT count(*) FROM searched"))
               : 0;
  };
  while (keyframes() < 3) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  ::kill(process, SIGKILL);
  ASSERT_EQ(exit_code_of(process), -SIGKILL);
  EXPECT_THAT(gelslam({"view", run}).err, HasSubstr("the scan was not finished; fuse the run"));
  const ProgramResult fused = gelslam({"fuse", run});
  EXPECT_EQ(fused.exit_code, 0) << fused.err;
  expect_complete(run);
  EXPECT_GE(report_of(run).at("keyframes").get<int>(), 3);
}

/// Three times, at random moments; GELSLAM_KILLS for more.
TEST(KilledScan, GoesOnFromItsLastKeyframe) {
  const char* wanted = std::getenv("GELSLAM_KILLS");
  std::mt19937 random(std::random_device{}());
  for (int round = wanted ? std::atoi(wanted) : 3; round > 0; --round) {
    const TemporaryFolder folder;
    const std::string run = (folder / "run").string();
    const double after_s =
        0.3 + 1e-3 * static_cast<double>(random() % 1200);  // of processor time: before tracking to the end
    const int code = run_signalled(replay_all({"-o", run, "-q"}), after_s, SIGKILL);
    if (code == 0 || !fs::exists(run + "/session.db")) continue;  // too late, or too early
    ASSERT_EQ(code, -SIGKILL);
    const ProgramResult left = gelslam({"info", run + "/session.db"});
    EXPECT_THAT(left.out, HasSubstr("the session of a run"));
    const int keyframes = std::stoi(sql(run + "/session.db", "SELECT count(*) FROM keyframes"));
    const ProgramResult more = gelslam(replay_all({"--continue", run}));
    if (keyframes < 2 && more.err.find("no touch in the map is large enough") != std::string::npos)
      continue;  // the first part was one faint touch, and stays the map
    ASSERT_EQ(more.exit_code, 0) << more.err << " killed after " << after_s << " s";
    expect_complete(run);
    const json report = report_of(run);
    EXPECT_GE(report.at("keyframes").get<int>(), keyframes + 1);
    EXPECT_GE(report.at("frames").at("total").get<int>(), kFrames);
    if (keyframes < 3) continue;  // a touch that has hardly begun may show too little to be found again
    EXPECT_EQ(report.at("components"), 1) << more.err;
  }
}

TEST(ContinuedRun, IsThatOfOneScanLiveAndOffline) {
  const TemporaryFolder folder;
  const std::string first = (folder / "first").string(), log = scan().log().string();
  fs::copy(scan().run(), first, fs::copy_options::recursive);
  const std::string before = read_bytes(first + "/session.db");
  std::string config = read_bytes(first + "/config.yaml");
  config.replace(config.find("voxel_size_mm: 0.08"), 19, "voxel_size_mm: 0.12");
  write_bytes(first + "/config.yaml", config);
  const ProgramResult offline =
      gelslam({"reconstruct", log, "--continue", first, "-o", (folder / "both").string()});
  ASSERT_EQ(offline.exit_code, 0) << offline.err;
  EXPECT_THAT(offline.err, HasSubstr("part 2 of 2 (" + log + "): joined, "));
  EXPECT_TRUE(read_bytes(first + "/session.db") == before) << "the run stays as it is";
  EXPECT_TRUE(read_bytes(folder / "both/config.yaml") == config) << "the run's, not the log's";
  expect_complete(folder / "both");
  EXPECT_EQ(report_of(folder / "both").at("frames").at("total"), 2 * kFrames);
  EXPECT_EQ(report_of(folder / "both").at("frames").at("left_out"), 0);
  EXPECT_EQ(report_of(folder / "both").at("components"), 1);

  ASSERT_EQ(gelslam(replay_all({"--continue", first, "-q"})).exit_code, 0);
  EXPECT_TRUE(read_bytes(first + "/config.yaml") == config);
  for (const char* file : {"mesh.ply", "trajectory.tum", "covariances.npy", "pose_graph.g2o"})
    EXPECT_TRUE(read_bytes(first + "/" + file) == read_bytes(folder / "both" / file)) << file;
  EXPECT_TRUE(saved_session(first) == saved_session(folder / "both"));
}

TEST(ContinuedRun, MistakesAreToldInALine) {
  const TemporaryFolder folder;
  const std::string log = scan().log().string(), run = (folder / "run").string();
  expect_mistake(gelslam(replay_all({"--continue", run})), "no such run folder");
  fs::copy(scan().run(), run, fs::copy_options::recursive);
  expect_mistake(gelslam(replay_all({"--continue", run, "-o", run})), "excludes");
  expect_mistake(gelslam({"reconstruct", log, "--continue", run, "-o", run, "--overwrite"}),
                 "holds the input");
  const std::string killed = run + "-killed";
  fs::create_directory(killed);
  fs::copy(run + "/session.db", killed + "/session.db");
  sql(killed + "/session.db", "DELETE FROM map");
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"view", killed, "--snapshot", run + ".png"},
        {"export", killed, "-o", run + ".stl"},
        {"evaluate", killed, "--truth", log},
        {"track", log, "--map", killed}})
    expect_mistake(gelslam(command), "the scan was not finished; fuse the run to make its map");
  fs::copy(run + "/report.json", killed + "/report.json");
  const std::string said = gelslam({"info", killed}).out;
  const std::size_t first = said.find("the scan was not finished");
  ASSERT_NE(first, std::string::npos) << said;
  EXPECT_EQ(said.find("the scan was not finished", first + 1), std::string::npos) << said;
  expect_mistake(gelslam({"fuse", log}), "is no run folder");
  fs::remove(run + "/session.db");
  expect_mistake(gelslam({"reconstruct", log, "--continue", run, "-o", run + "2"}), "holds no session.db");
  fs::copy(run, run + "3", fs::copy_options::recursive);
  expect_mistake(gelslam({"fuse", run, run + "3", "-o", run + "2"}), "holds no session.db");
  expect_mistake(gelslam({"fuse", run, run + "3"}), "--output");
  expect_mistake(gelslam({"fuse", run, run + "3", "-o", run + "2", "--voxel-size-mm", "0.1"}), "for one run");
  EXPECT_FALSE(fs::exists(run + "2"));
}

}  // namespace
}  // namespace gelslam
