// An object between two sensors that are fixed to each other, in the map that both made before.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "../support/run_program.hpp"
#include "gelslam/core/npy.hpp"
#include "simulated_scan.hpp"

namespace gelslam {
namespace {

using namespace test;
using nlohmann::json;
using testing::HasSubstr;

constexpr int kFrames = 40;

/// A peanut rolled between two sensors that face each other, their logs and the map of both.
class TwoSensors : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    write_rig("rig.yaml", 12.2);
    const ProgramResult simulated =
        gelslam({"simulate", "scan", "--object", "peanut", "--motion", "roll", "--frames",
                 std::to_string(kFrames), "--speed", "0.4", "--rig", path("rig.yaml"), "--calibration",
                 scan().model().parent_path().parent_path().string(), "-q", "-o", path("logs")});
    ASSERT_EQ(simulated.exit_code, 0) << simulated.err;
    const ProgramResult made = gelslam({"reconstruct", path("logs/first"), path("logs/second"), "--rig",
                                        path("rig.yaml"), "-q", "-o", path("run")});
    ASSERT_LE(made.exit_code, 1) << made.err;  // two frames before the other sensor touches do not join
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static std::string path(const std::string& name) { return (*folder_ / name).string(); }
  static void write_rig(const std::string& name, double distance_mm) {
    std::ofstream(path(name)) << "second_y: {x: 0, y: -1, z: 0}\nsecond_z: {x: 0, y: 0, z: -1}\n"
                              << "second_origin: {x: 1.5, y: 0.8, z: " << distance_mm << "}\n"
                              << "sigma_mm: 0.05\nsigma_deg: 0.1\n";
  }
  static json report_of(const std::string& run) {
    return json::parse(read_bytes(path(run + "/report.json")));
  }

 private:
  static inline std::unique_ptr<TemporaryFolder> folder_;
};

using Matrix = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

/// How far the poses of a stream are from the true ones, and which sensors they are of.
struct Localized {
  int frames = 0, of_first = 0, of_second = 0, of_both = 0;
  double mean_mm = 0, max_mm = 0;
};

Localized compare(const std::string& ndjson, const std::string& log, const json& report) {
  const std::vector<double> truth = read_npy(log + "/true_start_T_currs.npy").to_doubles();
  const auto start_T_sensor = [&](int frame) {
    return Matrix(truth.data() + std::ptrdiff_t{16} * (frame - kBackgroundFrames));
  };
  const Matrix map_T_start = start_T_sensor(report.at("anchor_frame").get<int>()).inverse();
  Localized found;
  int compared = 0;
  for (const std::string& line : lines_of(ndjson)) {
    const json frame = json::parse(line);
    const std::vector<int> sensors = frame.value("sensors", std::vector<int>{});
    found.of_first += sensors == std::vector<int>{0};
    found.of_second += sensors == std::vector<int>{1};
    found.of_both += sensors.size() == 2;
    EXPECT_EQ(frame.at("in_map"), !frame.at("pose").is_null());
    if (!frame.at("in_map").get<bool>()) continue;
    ++found.frames;
    const auto pose = frame.at("pose").get<std::vector<double>>();
    const Matrix truth_now = map_T_start * start_T_sensor(frame.at("frame").get<int>());
    const double mm =
        1000 * (Eigen::Vector3d(pose[3], pose[7], pose[11]) - truth_now.topRightCorner<3, 1>()).norm();
    if (std::isnan(mm)) continue;  // the first sensor was not touched: no truth
    found.max_mm = std::max(found.max_mm, mm);
    found.mean_mm += mm;
    ++compared;
  }
  found.mean_mm /= compared;
  return found;
}

using Trajectory = std::map<long, Eigen::Vector3d>;  // by milliseconds

Trajectory trajectory_of(const std::string& run) {
  Trajectory trajectory;
  for (const std::string& line : lines_of(read_bytes(run + "/trajectory.tum"))) {
    std::istringstream fields(line);
    double time_s = 0, x = 0, y = 0, z = 0;
    fields >> time_s >> x >> y >> z;
    trajectory[std::lround(1000 * time_s)] = {x, y, z};
  }
  return trajectory;
}

TEST_F(TwoSensors, GiveOnePoseOfTheObjectInTheHand) {
  const std::string first = path("logs/first"), second = path("logs/second"), run = path("run");
  const ProgramResult alone = gelslam({"track", first, "--map", run, "--format", "ndjson"});
  const ProgramResult both = gelslam({"track", first, second, "--map", run, "--format", "ndjson"});
  ASSERT_EQ(both.exit_code, 0) << both.err;
  EXPECT_EQ(both.err, "");
  EXPECT_EQ(alone.out.find("\"sensors\""), std::string::npos);
  EXPECT_NEAR(report_of("run").at("rig").at("first_T_second_mm")[11].get<double>(), 12.2, 0.1)
      << "as rig.yaml says, within two sigmas";
  const Localized by_one = compare(alone.out, first, report_of("run")),
                  by_both = compare(both.out, first, report_of("run"));
  EXPECT_GT(by_both.frames, by_one.frames) << "the second one feels what the first one does not";
  EXPECT_EQ(by_both.frames, kFrames);
  EXPECT_EQ(by_both.of_both, by_one.frames);
  EXPECT_EQ(by_both.of_both + by_both.of_second, kFrames);
  EXPECT_LT(by_both.mean_mm, 0.1) << "as in the map, whose sensors are calibrated by a few presses: 0.06 mm";
  EXPECT_LT(by_both.max_mm, 0.4);

  // By a wrong rig, each pose is of one sensor, and it is said.
  write_rig("wrong.yaml", 14.2);
  const ProgramResult wrong =
      gelslam({"track", first, second, "--map", run, "--rig", path("wrong.yaml"), "--format", "ndjson"});
  EXPECT_THAT(wrong.err, HasSubstr("the sensors contradict each other in"));
  EXPECT_EQ(compare(wrong.out, first, report_of("run")).of_both, 0);

  expect_mistake(gelslam({"track", first, second, "--map", run + "/session"}), "--rig");
  expect_mistake(gelslam({"track", first, second}), "--map");
  expect_mistake(gelslam({"track", "--camera", "7", "--camera", "/dev/video7", "--map", run}),
                 "--camera 7 and --camera /dev/video7 are both /dev/video7");
}

// Two sensors go on with the run of two, then one of them: all that was scanned before stays.
TEST_F(TwoSensors, ContinueARun) {
  const std::string first = path("logs/first"), second = path("logs/second"), run = path("continued");
  std::filesystem::copy(path("run"), run, std::filesystem::copy_options::recursive);
  const int keyframes = report_of("continued").at("keyframes");
  const ProgramResult two = gelslam(
      {"replay", first, second, "--every-frame", "--headless", "--rig", path("rig.yaml"), "--continue", run});
  ASSERT_EQ(two.exit_code, 0) << two.err;
  EXPECT_THAT(two.err, HasSubstr("part 4 of 4"));
  const ProgramResult one = gelslam({"replay", first, "--every-frame", "--headless", "--continue", run});
  ASSERT_EQ(one.exit_code, 0) << one.err;
  EXPECT_THAT(one.err, HasSubstr("part 5 of 5 (" + first + "): "));
  for (const char* kept : {"continued-first-2", "continued-second-2", "continued-2"})
    EXPECT_TRUE(std::filesystem::exists(path(kept))) << kept;

  const json report = report_of("continued");
  EXPECT_GT(report.at("keyframes"), 2 * keyframes);
  EXPECT_EQ(report.at("frames").at("total"), 5 * (kBackgroundFrames + kFrames));
  EXPECT_GT(report.at("frames").at("in_map"), 0.95 * 5 * kFrames);
  EXPECT_NEAR(report.at("rig").at("first_T_second_mm")[11].get<double>(), 12.2, 1.2)
      << "of the second session";
  std::vector<int> sensors;
  std::vector<double> starts_s;
  for (const json& log : report.at("logs")) {
    sensors.push_back(log.at("sensor"));
    starts_s.push_back(log.at("start_s"));
  }
  EXPECT_EQ(sensors, (std::vector<int>{0, 1, 0, 1, 0}));
  EXPECT_NEAR(starts_s[1], starts_s[0], 0.02);
  EXPECT_NEAR(starts_s[3], starts_s[2], 0.02);
  // The touches of one log, and so their poses, are the same in each session.
  const Trajectory poses = trajectory_of(run);
  const std::vector<json> logs = report.at("logs");
  int compared = 0;
  for (const auto& [time_ms, at] : poses) {
    const auto again = poses.find(time_ms + std::lround(1000 * logs[2].at("first_time_s").get<double>()));
    if (time_ms > 1000 * (kBackgroundFrames + kFrames) / 25 || again == poses.end()) continue;
    ++compared;
    EXPECT_LT((at - again->second).norm(), 1e-4) << time_ms;  // meters
  }
  EXPECT_GT(compared, 0.8 * kFrames);

  // What would fail at the end is said before the scan.
  std::filesystem::remove(path("continued/session/session.json"));
  expect_mistake(gelslam({"replay", first, second, "--headless", "--continue", run}), "gelslam fuse");
}

}  // namespace
}  // namespace gelslam
