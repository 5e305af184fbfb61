// From a simulated scan to a mesh and a trajectory, with the built program: gelslam simulate -> reconstruct,
// track -> evaluate. One sensor and one scan for all tests.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <nlohmann/json.hpp>
#include <opencv2/videoio.hpp>

#include "gelslam/core/trajectory.hpp"
#include "simulated_scan.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using namespace test;

json evaluate(const fs::path& run) {
  const ProgramResult result =
      gelslam({"evaluate", run.string(), "--truth", scan().log().string(), "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return json::parse(result.out);
}

/// A sensor that was calibrated on so few presses reads slopes up to 10 % wrong (simulate says its gain). A
/// wobble tilts by up to 10 degrees or so, of which one tenth is 1 degree; where the contact is 1 mm deep and
/// a tilt shifts it sideways, a tenth of that is 0.1 mm. A tracker that loses its way is off by several of
/// both.
void expect_good_trajectory(const json& trajectory) {
  EXPECT_GT(trajectory.at("tracked_share").get<double>(), 0.9);
  EXPECT_EQ(trajectory.at("estimated_without_touch"), 0);
  for (const char* axis : {"x_mm", "y_mm", "z_mm"})
    EXPECT_LT(trajectory.at("mae").at(axis).get<double>(), 0.1) << axis;
  for (const char* axis : {"rx_deg", "ry_deg", "rz_deg"})
    EXPECT_LT(trajectory.at("mae").at(axis).get<double>(), 1.0) << axis;
}

TEST(Reconstruct, AScanBecomesATrueTrajectoryAndATrueSurface) {
  const TemporaryFolder folder;
  const ProgramResult result =
      gelslam({"reconstruct", scan().log().string(), "-o", (folder / "run").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, testing::HasSubstr("frames tracked"));
  EXPECT_THAT(result.err, testing::HasSubstr(" cm² touched, "));
  EXPECT_THAT(folder.names(), testing::ElementsAre("run"));
  expect_complete(folder / "run");
  const json report = json::parse(read_bytes(folder / "run/report.json"));
  EXPECT_EQ(report.at("partial"), false);

  const json evaluation = evaluate(folder / "run");
  expect_good_trajectory(evaluation.at("trajectory"));
  // Placed by the known pose, the mesh carries the error of its anchor: a tilt of 1 degree over a contact 6
  // mm across is 0.1 mm at its border. Fitted by ICP only the shape counts: slopes 10 % wrong are 0.05 mm of
  // a contact 0.5 mm deep.
  EXPECT_LT(evaluation.at("mesh").at("known_pose").at("accuracy").at("mean_mm").get<double>(), 0.1);
  EXPECT_LT(evaluation.at("mesh").at("after_icp").at("accuracy").at("p90_mm").get<double>(), 0.05);
  // Something of what was touched must be there: all of it deeper than the contact's threshold of 0.2 mm.
  EXPECT_GT(evaluation.at("mesh").at("after_icp").at("within")[2].at("completeness").get<double>(), 0.2);
  // The run counts what it has in the mesh by itself, the evaluation by the true surface.
  const double true_cm2 =
      evaluation.at("mesh").at("area_cm2").get<double>() * evaluation.at("mesh").at("in_mesh").get<double>();
  EXPECT_NEAR(report.at("touched").at("in_mesh_cm2").get<double>(), true_cm2, 0.15 * true_cm2);
}

/// While it lives, this process and those it starts have one core.
class OneCore {
 public:
  OneCore() {
    sched_getaffinity(0, sizeof before_, &before_);
    cpu_set_t one;
    CPU_ZERO(&one);
    int first = 0;
    while (!CPU_ISSET(first, &before_)) ++first;
    CPU_SET(first, &one);
    sched_setaffinity(0, sizeof one, &one);
  }
  ~OneCore() { sched_setaffinity(0, sizeof before_, &before_); }

 private:
  cpu_set_t before_{};
};

TEST(Reconstruct, TheSameLogGivesTheSameBytesOnOneCoreAndOnAll) {
  const TemporaryFolder folder;
  const fs::path all = scan().run(), one = folder / "one";
  {
    const OneCore limit;
    const ProgramResult result = gelslam({"reconstruct", scan().log().string(), "-o", one.string(), "-q"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }
  for (const char* file : {"mesh.ply", "trajectory.tum", "keyframes.tum", "pose_graph.g2o", "session.db"})
    EXPECT_TRUE(read_bytes(all / file) == read_bytes(one / file)) << file;
}

TEST(Info, SaysWhatADataFolderIsGoodFor) {
  const ProgramResult words = gelslam({"info", scan().log().string()});
  EXPECT_EQ(words.exit_code, 0) << words.err;
  for (const char* part :
       {"a data folder", "GelSight Mini", "320x240, 25 Hz, 90 frames, 3.6 s", "network of 2370 weights",
        "use        gelslam reconstruct, scan, track, record --from, evaluate\n"})
    EXPECT_THAT(words.out, testing::HasSubstr(part));
  const json object = json::parse(gelslam({"info", scan().log().string(), "--json"}).out);
  EXPECT_EQ(object.at("use").at(0), "reconstruct");
  EXPECT_EQ(json::parse(gelslam({"info", scan().run().string(), "--json"}).out).at("path"),
            scan().run().string());
  EXPECT_TRUE(object.at("problems").empty());
}

/// Of frames that all show the touch.
TEST(Info, ALogThatReconstructWouldRefuseHasAProblem) {
  const TemporaryFolder folder;
  for (const char* name : {"config.yaml", "model.json", "optics.yaml"})
    fs::copy(scan().log() / name, folder / name);
  cv::VideoCapture all((scan().log() / "gelsight.avi").string());
  cv::VideoWriter touched((folder / "gelsight.avi").string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 25,
                          {320, 240});
  cv::Mat picture;
  for (int i = 0; all.read(picture); ++i)
    if (i >= 2 * kBackgroundFrames) touched.write(picture);
  touched.release();
  const ProgramResult info = gelslam({"info", folder.path().string()});
  EXPECT_EQ(info.exit_code, 1);
  EXPECT_THAT(info.out,
              testing::ContainsRegex("problem +the log's first 10 frames should show the bare gel, .* "
                                     "--background-frames .*, or give --force"));
}

TEST(Reconstruct, WarnsOfATruncatedLogAlsoWhenQuiet) {
  const TemporaryFolder folder;
  const std::string whole = read_bytes(scan().log() / "gelsight.avi"), torn = (folder / "torn.avi").string();
  write_bytes(torn, whole.substr(0, whole.size() / 3));
  const std::string model = scan().model().string(), run = (folder / "run").string();
  const std::vector<std::string> commands[] = {
      {"reconstruct", torn, "--model", model, "-q", "-o", run},
      {"scan", torn, "--model", model, "-q", "--headless", "--every-frame"}};
  for (const auto& command : commands) {
    const ProgramResult result = gelslam(command);
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.err, testing::HasSubstr("torn.avi ends after "));
    for (const std::string& line : lines_of(result.err)) EXPECT_THAT(line, testing::StartsWith("warning: "));
  }
}

TEST(Reconstruct, ARunThatLosesMostOfTheTouchIsNotDone) {
  const TemporaryFolder folder;
  const std::string log = (folder / "log").string();
  ASSERT_EQ(gelslam({"simulate", "scan", "--object", "peanut", "--motion", "allover", "--frames", "40", "-q",
                     "-o", log})
                .exit_code,
            0);
  const ProgramResult result = gelslam({"reconstruct", log, "-o", (folder / "run").string()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, testing::HasSubstr("touched frames are lost"));
  EXPECT_THAT(result.err, testing::HasSubstr("move more slowly"));
}

TEST(Reconstruct, StoppedInTheMiddleItKeepsWhatItHas) {
  const TemporaryFolder folder;
  constexpr int kFrames = 1500;
  write_long_log(folder / "log", kFrames);
  json report;
  // How fast a build is nobody knows: a little longer each time, until it was stopped after something was
  // tracked.
  for (double after_s = 0.8; after_s < 20; after_s *= 2) {
    fs::remove_all(folder / "run");
    const int exit_code = run_signalled({"reconstruct", (folder / "log").string(), "--model",
                                         scan().model().string(), "-o", (folder / "run").string(), "-q"},
                                        after_s, SIGINT);
    ASSERT_THAT(exit_code, testing::AnyOf(128 + SIGINT, -SIGINT));  // a signal: not even started
    if (!fs::exists(folder / "run/report.json")) continue;
    report = json::parse(read_bytes(folder / "run/report.json"));
    if (report.at("frames").at("tracked") > 20) break;
  }
  ASSERT_TRUE(report.is_object());
  EXPECT_EQ(report.at("partial"), true);
  EXPECT_LT(report.at("frames").at("total").get<int>(), kFrames);
  expect_complete(folder / "run");
  EXPECT_THAT(folder.names(), testing::ElementsAre("log", "run")) << "nothing temporary left";
}

/// However it ends: a run that is overwritten stays until the new one is whole.
TEST(Reconstruct, TheOldRunOrTheNewOneIsThereWhole) {
  const TemporaryFolder folder;
  const fs::path run = folder / "run";
  write_long_log(folder / "log", 300);
  const std::vector<std::string> arguments{"reconstruct", (folder / "log").string(),
                                           "--model",     scan().model().string(),
                                           "-o",          run.string(),
                                           "--overwrite", "-q"};
  ASSERT_EQ(run_signalled(arguments, 600, SIGKILL), 0);
  write_bytes(run / "screenshot_1.png", "of the old run");
  for (const int signal : {SIGKILL, SIGINT})
    for (double after_s = 0.05; run_signalled(arguments, after_s, signal) != 0; after_s *= 1.5) {
      expect_complete(run);
      EXPECT_EQ(json::parse(read_bytes(run / "report.json")).at("partial"), false);
    }
  expect_complete(run);
  EXPECT_FALSE(fs::exists(run / "screenshot_1.png")) << "it was replaced in the end";
  EXPECT_THAT(folder.names(), testing::ElementsAre("log", "run"));
}

TEST(Track, StreamsEveryFrame) {
  const ProgramResult ndjson = gelslam({"track", scan().log().string()});
  expect_mistake(gelslam({"track", scan().log().string(), "--format", "tum"}), "--format tum needs --map");
  const std::string shown = on_terminal(GELSLAM_PROGRAM " track " + scan().log().string() + " > /dev/null");
  EXPECT_THAT(shown, testing::HasSubstr("100%  90/90"));
  ASSERT_EQ(ndjson.exit_code, 0) << ndjson.err;

  const std::vector<std::string> objects = lines_of(ndjson.out);
  ASSERT_EQ(objects.size(), static_cast<std::size_t>(kBackgroundFrames + kScanFrames));
  std::size_t tracked = 0;
  std::string trajectory;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const json frame = json::parse(objects[i]);
    EXPECT_EQ(frame.at("frame"), i);
    EXPECT_NEAR(frame.at("time_s").get<double>(), static_cast<double>(i) / 25.0, 1e-9);
    EXPECT_TRUE(frame.at("reason").is_string());
    EXPECT_EQ(frame.at("observable").size(), 6u);
    EXPECT_TRUE(frame.at("scr").is_number() && frame.at("ccs").is_number());
    if (i < kBackgroundFrames) {
      EXPECT_EQ(frame.at("status"), "background");
    }
    if (frame.at("status") != "tracked") {
      EXPECT_TRUE(frame.at("map_pose").is_null() && frame.at("trial").is_null());
      EXPECT_TRUE(frame.at("sigma_mm").is_null() && frame.at("sigma_deg").is_null());
      continue;
    }
    EXPECT_EQ(frame.at("trial"), 0);
    const auto pose = frame.at("map_pose").get<std::vector<double>>();
    ASSERT_EQ(pose.size(), 16u);
    EXPECT_EQ(std::vector<double>(pose.begin() + 12, pose.end()), (std::vector<double>{0, 0, 0, 1}));

    // The trial's first frame is where it says; how far the others are off is known to some hundredths here.
    for (const double sigma_mm : frame.at("sigma_mm").get<std::array<double, 3>>())
      EXPECT_TRUE(tracked == 0 ? sigma_mm == 0 : sigma_mm > 1e-4 && sigma_mm < 0.5) << sigma_mm;
    EXPECT_EQ(frame.at("sigma_deg").size(), 3u);

    ++tracked;
    Pose pose_mm(Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(pose.data()));
    pose_mm.translation() *= 1000;
    trajectory += tum_line(frame.at("time_s"), pose_mm);
  }
  EXPECT_GT(tracked, 0.9 * kScanFrames);

  const TemporaryFolder folder;
  write_bytes(folder / "track.tum", trajectory);
  expect_good_trajectory(evaluate(folder / "track.tum").at("trajectory"));
}

}  // namespace
}  // namespace gelslam
