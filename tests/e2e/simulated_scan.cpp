#include "simulated_scan.hpp"

#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <thread>

#include "../support/database.hpp"

namespace gelslam::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

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

[[maybe_unused]] const SimulatedScan& registered_before_main = scan();

}  // namespace

void SimulatedScan::SetUp() {
  folder_ = std::make_unique<TemporaryFolder>();
  const ProgramResult scan = gelslam({"simulate", "scan", "--object", "peanut", "--motion", "wobble",
                                      "--frames", std::to_string(kScanFrames), "-o", log().string(), "-q"});
  ASSERT_EQ(scan.exit_code, 0) << scan.err;
}

fs::path SimulatedScan::run() const {
  const fs::path run = *folder_ / "run";
  if (!fs::exists(run)) {
    const ProgramResult result = gelslam({"reconstruct", log().string(), "-o", run.string(), "-q"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }
  return run;
}

SimulatedScan& scan() {
  static auto* const environment =
      dynamic_cast<SimulatedScan*>(testing::AddGlobalTestEnvironment(new SimulatedScan));
  return *environment;
}

void expect_complete(const fs::path& run) {
  const json report = json::parse(read_bytes(run / "report.json"));
  const std::size_t in_map = lines_of(read_bytes(run / "trajectory.tum")).size();
  EXPECT_EQ(report.at("frames").at("in_map"), in_map);
  EXPECT_GT(in_map, 0u);
  EXPECT_FALSE(lines_of(read_bytes(run / "keyframes.tum")).empty());
  EXPECT_GT(fs::file_size(run / "pose_graph.g2o"), 0u);
  EXPECT_GT(report.at("mesh").at("triangles").get<int>(), 100);
  EXPECT_TRUE(fs::exists(run / "session.db"));
  const ProgramResult info = gelslam({"info", run.string()});  // reads all files
  EXPECT_EQ(info.exit_code, 0) << info.err << info.out;
}

std::string saved_session(const fs::path& run) {
  return sql(
      run / "session.db",
      "SELECT * FROM map; SELECT keyframe, component, in_map, quote(pose) FROM poses;"
      "SELECT * FROM map_edges; SELECT id, frame, trial, quote(surface) FROM keyframes;"
      "SELECT frame, time_s, status, trial, keyframe, quote(keyframe_T_frame), observable FROM frames;"
      "SELECT from_keyframe, to_keyframe, kind, quote(from_T_to), quote(information), tentative FROM edges "
      "ORDER BY to_keyframe, id; SELECT * FROM searched");
}

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

int run_signalled(const std::vector<std::string>& arguments, double after_s, int signal) {
  const pid_t child = start_program(GELSLAM_PROGRAM, arguments);
  for (double used = 0; used >= 0 && used < after_s; used = processor_seconds(child))
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  ::kill(child, signal);
  return exit_code_of(child);
}

}  // namespace gelslam::test
