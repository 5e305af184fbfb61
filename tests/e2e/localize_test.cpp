// A log in the map that was made of it, and maps that are none.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>

#include "../support/run_program.hpp"
#include "simulated_scan.hpp"

namespace gelslam {
namespace {

using namespace test;
using nlohmann::json;

/// Positions in meters by time in milliseconds.
std::map<long, std::vector<double>> positions_of(const std::string& tum) {
  std::map<long, std::vector<double>> positions;
  for (const std::string& line : lines_of(tum)) {
    std::istringstream fields(line);
    double time_s = 0;
    std::vector<double> p(3);
    fields >> time_s >> p[0] >> p[1] >> p[2];
    positions[std::lround(1000 * time_s)] = p;
  }
  return positions;
}

double distance_mm(const std::vector<double>& pose, const std::vector<double>& position) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) sum += std::pow(pose[4 * k + 3] - position[k], 2);
  return 1000 * std::sqrt(sum);
}

TEST(TrackInAMap, TheScanIsFoundInItsOwnMap) {
  const TemporaryFolder folder;
  const std::string log = scan().log().string(), run = scan().run().string();
  const auto truth = positions_of(read_bytes(run + "/trajectory.tum"));

  const std::string of_mesh = (folder / "mesh.png").string(), of_patches = (folder / "patches.png").string();
  const ProgramResult ndjson =
      gelslam({"track", log, "--map", run, "--format", "ndjson", "--snapshot", of_mesh});
  std::filesystem::copy(run + "/session.db", folder / "session.db");
  const ProgramResult tum =
      gelslam({"track", log, "--map", folder.path().string(), "--snapshot", of_patches});
  ASSERT_EQ(ndjson.exit_code, 0) << ndjson.err;
  ASSERT_EQ(tum.exit_code, 0) << tum.err;
  const auto poses = positions_of(tum.out);
  std::size_t in_map = 0;
  for (const std::string& line : lines_of(ndjson.out)) {
    const json frame = json::parse(line);
    EXPECT_EQ(frame.at("in_map").get<bool>(), frame.at("status") == "localized");
    EXPECT_EQ(frame.at("map_pose").is_null(), !frame.at("in_map").get<bool>());
    EXPECT_EQ(frame.at("hypotheses").empty(),
              frame.at("status") != "localized" && frame.at("status") != "ambiguous");
    if (!frame.at("in_map").get<bool>()) continue;
    ++in_map;
    const auto pose = frame.at("map_pose").get<std::vector<double>>();
    const long time_ms = std::lround(1000 * frame.at("time_s").get<double>());
    ASSERT_TRUE(truth.contains(time_ms) && poses.contains(time_ms));
    EXPECT_LT(distance_mm(pose, truth.at(time_ms)), 0.15) << frame.at("frame");
    EXPECT_LT(distance_mm(pose, poses.at(time_ms)), 1e-6);
    EXPECT_GE(frame.at("hypotheses").at(0).at("probability").get<double>(), 0.95);
    for (const double sigma_mm : frame.at("sigma_mm").get<std::array<double, 3>>())
      EXPECT_TRUE(sigma_mm > 0 && sigma_mm < 0.5) << sigma_mm;
  }
  EXPECT_GT(in_map, 0.9 * kScanFrames);
  EXPECT_EQ(in_map, poses.size());
  EXPECT_THAT(tum.err, testing::HasSubstr("localized in " + std::to_string(in_map) +
                                          " of 90 frames, first in frame 1"));

  // The session alone has no mesh; that of its surfaces looks the same.
  const cv::Mat3b with_mesh = cv::imread(of_mesh), without_mesh = cv::imread(of_patches);
  ASSERT_EQ(with_mesh.size(), cv::Size(1280, 800));
  ASSERT_EQ(without_mesh.size(), cv::Size(1280, 800));
  int glowing = 0, different = 0;
  for (int v = 120; v < 720; ++v)
    for (int u = 0; u < 960; ++u) {
      const cv::Vec3b a = with_mesh(v, u), b = without_mesh(v, u);
      glowing += a[2] - a[0] > 60;
      different += cv::norm(cv::Vec3d(a) - cv::Vec3d(b)) > 40;
    }
  EXPECT_GT(glowing, 5000);
  EXPECT_LT(different, 5000);

  write_bytes(folder / "fine.yaml", "device_config:\n  ppmm: 0.05\n");
  expect_mistake(gelslam({"track", log, "--map", run, "--config", (folder / "fine.yaml").string(), "--model",
                          scan().model().string()}),
                 "pixels of 0.0634 mm, not of 0.05 mm as the sensor");
  // A camera has the configuration and the model of the run: only the camera itself is missing.
  expect_mistake(gelslam({"track", "--camera", "/dev/video987", "--map", run}), "/dev/video987");
}

TEST(Map, OfAMeshIsAFolderThatTrackAndViewRead) {
  const TemporaryFolder folder;
  const std::string mesh = (scan().log() / "gt_mesh.ply").string(), map = (folder / "map").string();
  const ProgramResult made = gelslam({"map", mesh, "-o", map, "--touches", "20"});
  EXPECT_EQ(made.exit_code, 1) << "20 touches do not cover a peanut";
  EXPECT_THAT(made.err, testing::HasSubstr("allow more touches"));
  EXPECT_EQ(json::parse(read_bytes(folder / "map/map.json")).at("touches"), 20);
  EXPECT_EQ(gelslam({"view", map, "--snapshot", (folder / "map.png").string()}).exit_code, 0);
  const ProgramResult poses = gelslam({"track", scan().log().string(), "--map", map, "--format", "ndjson"});
  EXPECT_EQ(lines_of(poses.out).size(), static_cast<std::size_t>(kBackgroundFrames + kScanFrames))
      << poses.err;
  expect_mistake(gelslam({"map", mesh, "-o", map}), "already");
  expect_mistake(gelslam({"map", (folder / "none.stl").string(), "-o", map, "--overwrite"}), "none.stl");
  expect_mistake(gelslam({"map", mesh, "--unit", "ft", "-o", map}), "ft");
  EXPECT_THAT(gelslam({"map", mesh, "--unit", "mm", "-o", map, "--overwrite", "--touches", "2"}).err,
              testing::HasSubstr("gt_mesh.ply: m, as the file notes"));
}

TEST(TrackInAMap, WhyNothingWasLocalizedIsSaid) {
  const TemporaryFolder folder;
  cv::VideoCapture video((scan().log() / "gelsight.avi").string());
  for (int i = 0; i < kBackgroundFrames; ++i) {
    cv::Mat bare;
    ASSERT_TRUE(video.read(bare));
    cv::imwrite((folder / std::to_string(i)).string() + ".png", bare);
  }
  const ProgramResult none = gelslam({"track", folder.path().string(), "--map", scan().run().string(),
                                      "--model", scan().model().string(), "-q"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_EQ(none.err, "never localized: nothing was touched\n");
}

TEST(TrackInAMap, WhatIsNoMapIsSaidInOneLine) {
  const TemporaryFolder folder;
  const std::string log = scan().log().string();
  expect_mistake(gelslam({"track", log, "--map", (folder / "none").string()}), "no map; give a run folder");
  expect_mistake(gelslam({"track", log, "--map", log}), "no map");
  write_bytes(folder / "session.db", "{");
  expect_mistake(gelslam({"track", log, "--map", folder.path().string()}), "damaged");
  expect_mistake(gelslam({"track", "--map", log}), "give a LOG, or --camera");
  expect_mistake(gelslam({"track", log, "--camera"}), "not both");
  expect_mistake(gelslam({"track", log, "--window"}), "need --map");
  expect_mistake(gelslam({"track", log, "--map", log, "--snapshot", "map.jpg"}), ".png");
}

}  // namespace
}  // namespace gelslam
