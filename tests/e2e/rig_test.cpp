// Two sensors that hold an object between them: gelslam simulate scan --rig, then reconstruct --rig.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "../support/run_program.hpp"
#include "gelslam/core/trajectory.hpp"
#include "simulated_scan.hpp"

namespace gelslam {
namespace {

using namespace test;
using testing::HasSubstr;

constexpr double kDistanceMm = 20.35;  // a golf ball of half size, pressed by 0.5 mm from both sides

nlohmann::json report_of(const std::filesystem::path& run) {
  std::ifstream stream(run / "report.json");
  return nlohmann::json::parse(stream);
}

std::string facing_at(double distance_mm) {
  return "second_y: {x: 0, y: -1, z: 0}\nsecond_z: {x: 0, y: 0, z: -1}\nsecond_origin: {x: 1.5, y: 0.8, z: " +
         std::to_string(distance_mm) + "}\n";
}

TEST(RigProgram, TwoSensorsMakeOneMapAndTellHowTheyAreFixed) {
  const TemporaryFolder folder;
  const auto rig = folder / "rig.yaml";
  std::ofstream(rig) << facing_at(kDistanceMm);
  const ProgramResult simulated =
      gelslam({"simulate", "scan", "--object", "golf", "--size", "0.5", "--motion", "roll", "--frames", "80",
               "--speed", "1", "--rig", rig.string(), "--calibration",
               scan().model().parent_path().parent_path().string(), "-q", "-o", (folder / "logs").string()});
  ASSERT_EQ(simulated.exit_code, 0) << simulated.err;
  const std::string first = (folder / "logs/first").string(), second = (folder / "logs/second").string();
  const auto run = folder / "run";
  const ProgramResult done = gelslam({"reconstruct", first, second, "--rig", "-o", run.string()});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("the second sensor is at"));
  const nlohmann::json report = report_of(run);
  EXPECT_EQ(report.at("components"), 1);
  const auto found = report.at("rig").at("first_T_second_mm").get<std::vector<double>>();
  // A few presses have calibrated the sensors: they read slopes up to 10 % wrong, and with them the distance.
  EXPECT_NEAR(found[3], 1.5, 0.5);
  EXPECT_NEAR(found[7], 0.8, 0.5);
  EXPECT_NEAR(found[11], kDistanceMm, 0.1 * kDistanceMm);
  EXPECT_LT(found[10], -0.99) << "they face each other";

  // One log of both gives the same, each by its own configuration and model.
  const std::string both = (folder / "both.mkv").string();
  const ProgramResult recorded = gelslam({"record", "--from", first, "--from", second, "-o", both});
  ASSERT_EQ(recorded.exit_code, 0) << recorded.err;
  EXPECT_THAT(recorded.err, HasSubstr("of two sensors"));
  EXPECT_THAT(gelslam({"info", both}).out, HasSubstr("a recorded log of two sensors"));
  const ProgramResult of_one_log = gelslam({"reconstruct", both, "-o", (folder / "one").string()});
  ASSERT_EQ(of_one_log.exit_code, 0) << of_one_log.err;
  for (const char* file : {"trajectory.tum", "mesh.ply"})
    EXPECT_TRUE(read_bytes(run / file) == read_bytes(folder / "one" / file)) << file;

  // What is known of the rig holds where it is known better than the motions tell.
  std::ofstream(rig, std::ios::app) << "sigma_mm: 0.01\nsigma_deg: 0.1\n";

  // Live, each sensor has a run of its own, which can be joined once more.
  const std::string live = (folder / "live").string();
  const ProgramResult played = gelslam({"replay", first, second, "--every-frame", "--headless", "--stream",
                                        "-", "--rig", rig.string(), "-o", live});
  ASSERT_EQ(played.exit_code, 0) << played.err;
  EXPECT_NEAR(report_of(live).at("rig").at("first_T_second_mm")[11].get<double>(), kDistanceMm, 0.05);
  std::map<int, int> frames;
  for (const std::string& line : lines_of(played.out)) {
    const nlohmann::json object = nlohmann::json::parse(line);
    if (object.at("type") == "frame") ++frames[object.at("sensor").get<int>()];
  }
  EXPECT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0], frames[1]);
  const ProgramResult merged = gelslam({"merge", live + "-first", live + "-second", "--rig", rig.string(),
                                        "-q", "-o", (folder / "merged").string()});
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_TRUE(read_bytes(folder / "merged/mesh.ply") == read_bytes(live + "/mesh.ply"));

  // Its record holds what the rig says as loops: the mesh is made again without the logs.
  std::filesystem::remove(live + "/session/session.json");
  std::filesystem::remove(live + "/mesh.ply");
  const ProgramResult fused = gelslam({"fuse", live});
  EXPECT_EQ(fused.exit_code, 0) << fused.err;
  EXPECT_EQ(report_of(live).at("components"), 1);
  EXPECT_NEAR(report_of(live).at("rig").at("first_T_second_mm")[11].get<double>(), kDistanceMm, 0.05);
}

TEST(RigProgram, MistakesAreSaidInOneLine) {
  const ProgramResult one = gelslam({"reconstruct", "a.mkv", "--rig", "-o", "run"});
  EXPECT_THAT(one.err, HasSubstr("--rig takes the logs of two sensors"));
  const ProgramResult missing = gelslam({"reconstruct", "a.mkv", "b.mkv", "--rig", "none.yaml", "-o", "run"});
  EXPECT_THAT(missing.err, HasSubstr("none.yaml"));
  const std::string log = scan().log().string();
  EXPECT_THAT(gelslam({"reconstruct", log, log, "--rig", "-o", "run"}).err, HasSubstr("is given twice"));
  const ProgramResult same = gelslam({"scan", "--camera", "7", "--camera", "7", "--headless", "-o", "run",
                                      "--model", scan().model().string()});
  EXPECT_THAT(same.err, HasSubstr("--camera 7 and --camera 7 are both /dev/video7"));
  const std::string other = log + "-again";  // beside it, where its model is found
  std::filesystem::copy(log, other, std::filesystem::copy_options::recursive);
  const ProgramResult nowhere = gelslam({"replay", log, other, "--headless"});
  EXPECT_THAT(nowhere.err, HasSubstr("two sensors need a run folder"));
  const ProgramResult tum =
      gelslam({"replay", log, other, "--headless", "-o", "run", "--stream", "-", "--stream-format", "tum"});
  EXPECT_THAT(tum.err, HasSubstr("does not tell two sensors apart"));
}

}  // namespace
}  // namespace gelslam
