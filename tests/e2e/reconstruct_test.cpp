// From a simulated scan to a mesh and a trajectory, with the built program: gelslam simulate -> reconstruct,
// track -> evaluate. One sensor and one scan for all tests.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>
#include <thread>

#include "../support/run_program.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::ProgramResult;
using test::read_bytes;
using test::TemporaryFolder;

constexpr int kBackgroundFrames = 10, kScanFrames = 80;

ProgramResult gelslam(const std::vector<std::string>& arguments) {
  return test::run_program(GELSLAM_PROGRAM, arguments);
}

/// A peanut wobbled over a sensor that was calibrated on few presses.
class SimulatedScan : public testing::Environment {
 public:
  void SetUp() override {
    folder_ = std::make_unique<TemporaryFolder>();
    const ProgramResult calibration = gelslam({"simulate", "calibration", "--presses", "60", "--epochs", "20",
                                               "-o", (*folder_ / "calibration").string(), "-q"});
    ASSERT_EQ(calibration.exit_code, 0) << calibration.err;
    const ProgramResult scan = gelslam({"simulate", "scan", "--object", "peanut", "--motion", "wobble",
                                        "--frames", std::to_string(kScanFrames), "--calibration",
                                        (*folder_ / "calibration").string(), "-o", log().string(), "-q"});
    ASSERT_EQ(scan.exit_code, 0) << scan.err;
  }
  void TearDown() override { folder_.reset(); }
  fs::path log() const { return *folder_ / "scan"; }
  fs::path model() const { return *folder_ / "calibration/model/nnmodel.pth"; }

 private:
  std::unique_ptr<TemporaryFolder> folder_;
};

SimulatedScan& scan() {
  static auto* const environment =
      dynamic_cast<SimulatedScan*>(testing::AddGlobalTestEnvironment(new SimulatedScan));
  return *environment;
}
[[maybe_unused]] const SimulatedScan& registered_before_main = scan();

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

std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// A run folder with all its files, which agree with each other.
void expect_complete(const fs::path& run) {
  const json report = json::parse(read_bytes(run / "report.json"));
  const std::size_t in_map = lines_of(read_bytes(run / "trajectory.tum")).size();
  EXPECT_EQ(report.at("frames").at("in_map"), in_map);
  EXPECT_GT(in_map, 0u);
  EXPECT_FALSE(lines_of(read_bytes(run / "keyframes.tum")).empty());
  EXPECT_GT(fs::file_size(run / "pose_graph.g2o"), 0u);
  EXPECT_GT(report.at("mesh").at("triangles").get<int>(), 100);
  EXPECT_TRUE(fs::exists(run / "session/session.json"));
  for (const char* readable : {"mesh.ply", "config.yaml", "."}) {
    const ProgramResult info = gelslam({"info", (run / readable).string()});
    EXPECT_EQ(info.exit_code, 0) << readable << ": " << info.err << info.out;
  }
}

TEST(Reconstruct, AScanBecomesATrueTrajectoryAndATrueSurface) {
  const TemporaryFolder folder;
  const ProgramResult result =
      gelslam({"reconstruct", scan().log().string(), "-o", (folder / "run").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, testing::HasSubstr("frames tracked"));
  EXPECT_THAT(folder.names(), testing::ElementsAre("run"));
  expect_complete(folder / "run");
  EXPECT_EQ(json::parse(read_bytes(folder / "run/report.json")).at("partial"), false);

  const json evaluation = evaluate(folder / "run");
  expect_good_trajectory(evaluation.at("trajectory"));
  // Placed by the known pose, the mesh carries the error of its anchor: a tilt of 1 degree over a contact 6
  // mm across is 0.1 mm at its border. Fitted by ICP only the shape counts: slopes 10 % wrong are 0.05 mm of
  // a contact 0.5 mm deep.
  EXPECT_LT(evaluation.at("mesh").at("known_pose").at("accuracy").at("mean_mm").get<double>(), 0.1);
  EXPECT_LT(evaluation.at("mesh").at("after_icp").at("accuracy").at("p90_mm").get<double>(), 0.05);
  EXPECT_EQ(evaluation.at("mesh").at("stacked_share"), 0.0);
  // Something of what was touched must be there: all of it deeper than the contact's threshold of 0.2 mm.
  EXPECT_GT(evaluation.at("mesh").at("after_icp").at("within")[2].at("completeness").get<double>(), 0.2);
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
  const auto run = [&](const char* name) {
    const ProgramResult result =
        gelslam({"reconstruct", scan().log().string(), "-o", (folder / name).string(), "-q"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
  };
  run("all");
  {
    const OneCore limit;
    run("one");
  }
  for (const char* file :
       {"mesh.ply", "trajectory.tum", "keyframes.tum", "pose_graph.g2o", "session/session.json"})
    EXPECT_TRUE(read_bytes(folder / "all" / file) == read_bytes(folder / "one" / file)) << file;
}

/// The scan to and fro, as a folder of pictures of any length.
void write_long_log(const fs::path& folder, int frames) {
  fs::create_directory(folder);
  cv::VideoCapture video((scan().log() / "gelsight.avi").string());
  std::vector<fs::path> pictures;
  const auto name = [&](int i) { return folder / (std::to_string(i) + ".png"); };
  for (cv::Mat image; video.read(image); pictures.push_back(name(static_cast<int>(pictures.size()))))
    cv::imwrite(name(static_cast<int>(pictures.size())).string(), image);
  const int recorded = static_cast<int>(pictures.size()), first = kBackgroundFrames + 20,
            range = recorded - first;
  ASSERT_EQ(recorded, kBackgroundFrames + kScanFrames);
  for (int i = recorded; i < frames; ++i) {
    const int phase = (i - recorded) % (2 * range), back = phase < range ? range - 1 - phase : phase - range;
    fs::create_hard_link(name(first + back), name(i));
  }
}

/// Seconds of processor time that a running child has used: unlike time on the wall, it tells how far the
/// child is whatever else the machine does. Negative once it has ended.
double processor_seconds(pid_t child) {
  siginfo_t ended{};
  if (::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
      ended.si_pid != 0)
    return -1;
  const std::string stat = read_bytes("/proc/" + std::to_string(child) + "/stat");
  std::istringstream fields(stat.substr(stat.rfind(')') + 1));
  std::string skipped;
  for (int i = 0; i < 11; ++i) fields >> skipped;
  double user = 0, system = 0;
  fields >> user >> system;
  return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

/// Starts the program, asks it to stop (as Ctrl-C does) after `after_s` of processor time; its exit code.
int run_interrupted(const std::vector<std::string>& arguments, double after_s) {
  std::vector<char*> argv{const_cast<char*>(GELSLAM_PROGRAM)};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  pid_t child = 0;
  if (::posix_spawn(&child, GELSLAM_PROGRAM, nullptr, nullptr, argv.data(), environ) != 0) return -1;
  for (double used = 0; used >= 0 && used < after_s; used = processor_seconds(child))
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  ::kill(child, SIGINT);
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

TEST(Reconstruct, StoppedInTheMiddleItKeepsWhatItHas) {
  const TemporaryFolder folder;
  constexpr int kFrames = 1500;
  write_long_log(folder / "log", kFrames);
  json report;
  // How fast a build is nobody knows: a little longer each time, until it was stopped after something was
  // tracked.
  for (double after_s = 0.4; after_s < 20; after_s *= 2) {
    const int exit_code =
        run_interrupted({"reconstruct", (folder / "log").string(), "--model", scan().model().string(), "-o",
                         (folder / "run").string(), "--overwrite", "-q"},
                        after_s);
    ASSERT_THAT(exit_code,
                testing::AnyOf(0, 1, -SIGINT));  // 1: nothing tracked yet; a signal: not even started
    if (exit_code != 0) continue;
    report = json::parse(read_bytes(folder / "run/report.json"));
    if (report.at("frames").at("tracked") > 20) break;
  }
  ASSERT_TRUE(report.is_object());
  EXPECT_EQ(report.at("partial"), true);
  EXPECT_LT(report.at("frames").at("total").get<int>(), kFrames);
  expect_complete(folder / "run");
  EXPECT_THAT(folder.names(), testing::ElementsAre("log", "run")) << "nothing temporary left";
}

/// Digits of a number as written, without leading zeros, point and exponent.
int significant_digits(const std::string& number) {
  int digits = 0;
  for (const char c : number.substr(0, number.find_first_of("eE")))
    if (std::isdigit(static_cast<unsigned char>(c)) && (c != '0' || digits > 0)) ++digits;
  return digits;
}

TEST(Track, StreamsEveryFrameAsNdjsonAndTrackedOnesAsTum) {
  const ProgramResult ndjson = gelslam({"track", scan().log().string(), "--format", "ndjson"});
  const ProgramResult tum = gelslam({"track", scan().log().string()});
  ASSERT_EQ(ndjson.exit_code, 0) << ndjson.err;
  ASSERT_EQ(tum.exit_code, 0) << tum.err;

  const std::vector<std::string> objects = lines_of(ndjson.out), lines = lines_of(tum.out);
  ASSERT_EQ(objects.size(), static_cast<std::size_t>(kBackgroundFrames + kScanFrames));
  std::size_t tracked = 0;
  int most_digits = 0;
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
      EXPECT_TRUE(frame.at("pose").is_null() && frame.at("trial").is_null());
      continue;
    }
    EXPECT_EQ(frame.at("trial"), 0);
    const auto pose = frame.at("pose").get<std::vector<double>>();
    ASSERT_EQ(pose.size(), 16u);
    EXPECT_EQ(std::vector<double>(pose.begin() + 12, pose.end()), (std::vector<double>{0, 0, 0, 1}));

    ASSERT_LT(tracked, lines.size());
    std::istringstream fields(lines[tracked++]);
    std::vector<std::string> words;
    for (std::string word; fields >> word;) words.push_back(word);
    ASSERT_EQ(words.size(), 8u);
    const auto number = [&](std::size_t k) { return std::stod(words[k]); };
    EXPECT_NEAR(number(0), frame.at("time_s").get<double>(), 1e-9);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(number(1 + k), pose[k * 4 + 3], 1e-9 * (1e-3 + std::abs(pose[k * 4 + 3])));
    // The rotation's third column from the quaternion (x y z w).
    const double x = number(4), y = number(5), z = number(6), w = number(7);
    EXPECT_NEAR(x * x + y * y + z * z + w * w, 1, 1e-9);
    EXPECT_NEAR(2 * (x * z + w * y), pose[2], 1e-9);
    EXPECT_NEAR(2 * (y * z - w * x), pose[6], 1e-9);
    EXPECT_NEAR(1 - 2 * (x * x + y * y), pose[10], 1e-9);
    for (std::size_t k = 1; k < 8; ++k) most_digits = std::max(most_digits, significant_digits(words[k]));
  }
  EXPECT_EQ(tracked, lines.size());
  EXPECT_GT(tracked, 0.9 * kScanFrames);
  EXPECT_GE(most_digits, 9);

  const TemporaryFolder folder;
  test::write_bytes(folder / "track.tum", tum.out);
  expect_good_trajectory(evaluate(folder / "track.tum").at("trajectory"));
}

}  // namespace
}  // namespace gelslam
