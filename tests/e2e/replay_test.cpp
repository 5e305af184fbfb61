// A log through the live program, as if it came from a camera: gelslam scan LOG without a window.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>

#include "../support/data_folder.hpp"
#include "../support/run_program.hpp"
#include "simulated_scan.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using namespace test;
using nlohmann::json;
using testing::HasSubstr;

std::vector<std::string> replay(const std::vector<std::string>& more) {
  std::vector<std::string> arguments{"scan", "--headless", "--model", scan().model().string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

TEST(Replay, WithEveryFrameTheRunIsThatOfReconstruct) {
  const TemporaryFolder folder;
  const ProgramResult live =
      gelslam(replay({scan().log().string(), "--every-frame", "-o", (folder / "live").string()}));
  ASSERT_EQ(live.exit_code, 0) << live.err;
  EXPECT_THAT(live.err, HasSubstr("tracking\n"));
  EXPECT_THAT(live.err, HasSubstr("0 dropped"));
  expect_complete(folder / "live");
  for (const char* file :
       {"mesh.ply", "trajectory.tum", "covariances.npy", "keyframes.tum", "pose_graph.g2o"})
    EXPECT_TRUE(read_bytes(folder / "live" / file) == read_bytes(scan().run() / file)) << file;
  EXPECT_TRUE(saved_session(folder / "live") == saved_session(scan().run()));
}

struct PacedLog {
  std::string name;
  std::vector<std::string> words;  // the log and its settings
};

/// A simulated hand that is fast, rendered logs, and real ones.
std::vector<PacedLog> paced_logs(const fs::path& folder) {
  const std::string fast = (folder / "fast").string();
  EXPECT_EQ(gelslam({"simulate", "scan", "--object", "peanut", "--size", "0.6", "--motion", "allover",
                     "--frames", "150", "-q", "-o", fast})
                .exit_code,
            0);
  std::vector<PacedLog> logs{{"fast", {fast}}};
  const fs::path data = data_folder();
  if (!fs::exists(data)) return logs;
  for (const char* name : {"sequences/hard_fast", "sequences/hard_weave", "ablation/ablate_strawberry"})
    logs.push_back({fs::path(name).filename().string(), {(data / name).string()}});
  write_bytes(folder / "dots.yaml", "device_config:\n  ppmm: 0.0453\n  raw_imgw: 320\n  raw_imgh: 240\n");
  const std::string model = (data / "real/nnmini.pt").string();
  for (const char* name : {"tin_box_2", "wooden_statue_1"}) {
    const fs::path pair = data / "real/pairs" / name;
    logs.push_back({name,
                    {(pair / "left.avi").string(), "--model", model, "--background",
                     (pair / "background_left.png").string(), "--config", (folder / "dots.yaml").string()}});
  }
  return logs;
}

/// Live trackers used to have no time for the steps of a fast hand.
TEST(Replay, AtTheLogsPaceTheRunIsThatOfReconstruct) {
  const TemporaryFolder folder;
  for (const PacedLog& log : paced_logs(folder / ".")) {
    const auto run = [&](std::vector<std::string> words, const std::string& output) {
      words.insert(words.end(), log.words.begin(), log.words.end());
      words.insert(words.end(), {"-o", (folder / (log.name + output)).string()});
      return gelslam(words);
    };
    const ProgramResult live = run({"scan", "--headless"}, "_live"),
                        offline = run({"reconstruct"}, "_offline");
    if (live.err.find(" 0 dropped") == std::string::npos) continue;  // a machine that is too slow
    EXPECT_EQ(live.exit_code, offline.exit_code) << live.err;
    for (const char* file :
         {"mesh.ply", "trajectory.tum", "covariances.npy", "keyframes.tum", "pose_graph.g2o"})
      EXPECT_TRUE(read_bytes(folder / (log.name + "_live") / file) ==
                  read_bytes(folder / (log.name + "_offline") / file))
          << log.name << " " << file;
  }
}

/// Frames of an NDJSON stream; keyframes and maps are counted.
std::vector<json> frames_of(const std::string& stream, int& keyframes, int& maps) {
  std::vector<json> frames;
  for (const std::string& line : lines_of(stream)) {
    json object = json::parse(line);
    keyframes += object.at("type") == "keyframe";
    maps += object.at("type") == "map";
    if (object.at("type") == "frame") frames.push_back(std::move(object));
  }
  return frames;
}

TEST(Replay, StreamsThePosesOfTrack) {
  const ProgramResult live = gelslam(replay({scan().log().string(), "--every-frame", "-q", "--stream", "-",
                                             "--stream-surface", "--stream-images"}));
  ASSERT_EQ(live.exit_code, 0) << live.err;
  EXPECT_EQ(live.err, "");
  const ProgramResult offline = gelslam({"track", scan().log().string(), "--format", "ndjson"});
  const std::vector<std::string> live_lines = lines_of(live.out);
  int keyframes = 0, maps = 0, none = 0;
  const std::vector<json> streamed = frames_of(live.out, keyframes, maps),
                          tracked = frames_of(offline.out, none, none);
  ASSERT_EQ(streamed.size(), tracked.size());
  EXPECT_EQ(none, 0);
  EXPECT_GT(keyframes, 1);
  EXPECT_GT(maps, 0);
  const auto images = std::count_if(live_lines.begin(), live_lines.end(), [](const std::string& line) {
    return line.find(R"("jpeg":"/9j/)") != std::string::npos;  // as a JPEG begins
  });
  EXPECT_EQ(images, static_cast<std::ptrdiff_t>(streamed.size()));
  for (std::size_t k = 0; k < streamed.size(); ++k)
    for (const char* key :
         {"frame", "time_s", "time_unix_s", "status", "trial", "pose", "observable", "contact"})
      EXPECT_EQ(streamed[k].at(key), tracked[k].at(key)) << key << " of frame " << k;
}

// The map of a single trial differs from its poses by what loops correct, a tenth of a millimeter here. At
// the log's own pace, which leaves the mapper time to make one.
TEST(Replay, StreamsThePlacesOfFramesInTheMap) {
  const ProgramResult live = gelslam(replay({scan().log().string(), "-q", "--stream", "-"}));
  int keyframes = 0, maps = 0, placed = 0;
  for (const json& frame : frames_of(live.out, keyframes, maps)) {
    if (frame.at("map_pose").is_null()) continue;
    ++placed;
    for (const std::size_t shift : {3, 7, 11})
      EXPECT_NEAR(frame.at("map_pose").at(shift).get<double>(), frame.at("pose").at(shift).get<double>(),
                  2e-4);
  }
  EXPECT_GT(placed, 0);
}

TEST(Replay, ATrackThatServesLeavesStdoutAlone) {
  EXPECT_THAT(gelslam({"track", scan().log().string(), "-q"}).out, HasSubstr("\"frame\""));
  const ProgramResult served =
      gelslam({"track", scan().log().string(), "-q", "--serve", "0", "--token", "word"});
  EXPECT_EQ(served.exit_code, 0) << served.err;
  EXPECT_EQ(served.out, "") << "a pipe that nobody reads would hold it up";
}

TEST(Replay, StreamsThatCannotBeAreRefusedInOneLine) {
  const std::string log = scan().log().string();
  expect_mistake(gelslam(replay({log, "--stream", "tcp:5555"})), "should be -; other programs read --serve");
  for (const char* address : {"99999", "x", "-1", "80a", "host:", ":80"})
    expect_mistake(gelslam(replay({log, "--serve", address})), "a port is a number from 1 to 65535");
  expect_mistake(gelslam(replay({log, "--serve", "203.0.113.7:0"})), "is no address of this machine");
  expect_mistake(gelslam(replay({log, "--stream-surface"})), "--stream-surface needs --stream");
  expect_mistake(gelslam(replay({log, "--stream", "-", "--stream-format", "tum", "--stream-images"})),
                 "--stream-images needs --stream-format ndjson");
}

TEST(Replay, AtTheSensorsRateItTakesAsLongAsTheScanTook) {
  const TemporaryFolder folder;
  const ProgramResult result =
      gelslam(replay({scan().log().string(), "-o", (folder / "run").string(), "-q"}));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json report = json::parse(read_bytes(folder / "run/report.json"));
  const json& live = report.at("live");
  EXPECT_EQ(live.at("arrived"), kBackgroundFrames + kScanFrames);
  EXPECT_EQ(live.at("arrived"), report.at("frames").at("total").get<int>() + live.at("dropped").get<int>());
  // Nothing comes earlier than recorded; how much later depends on the machine.
  EXPECT_GT(report.at("seconds").get<double>(), (kBackgroundFrames + kScanFrames - 1) / 25.0);
  EXPECT_EQ(report.at("partial"), false);
}

TEST(Replay, NobodyElseWritesToItsRun) {
  const TemporaryFolder folder;
  write_long_log(folder / "log", 1500);
  const std::string log = scan().log().string(), run = (folder / "run").string();
  const pid_t first = start_program(GELSLAM_PROGRAM, replay({(folder / "log").string(), "-o", run, "-q"}));
  while (!fs::exists(run + "/session.db")) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const std::string who = "another program (gelslam, process " + std::to_string(first) + ") is writing to";
  expect_mistake(gelslam({"reconstruct", log, "-o", run, "--overwrite"}), who);
  expect_mistake(gelslam(replay({log, "-o", run, "--overwrite"})), who);
  expect_mistake(gelslam(replay({log, "--continue", run})), who);
  expect_mistake(gelslam({"fuse", run}), who);
  ::kill(first, SIGINT);
  EXPECT_EQ(exit_code_of(first), 128 + SIGINT);
  EXPECT_EQ(json::parse(read_bytes(run + "/report.json")).at("log"), (folder / "log").string());
  EXPECT_THAT(folder.names(), testing::ElementsAre("log", "run"));
}

TEST(Replay, DoesNotReplaceTheRunThatHoldsItsLog) {
  const TemporaryFolder folder;
  const fs::path run = folder / "run";
  fs::create_directory(run);
  for (const char* ours : {"report.json", "screenshot_001.png"}) std::ofstream(run / ours) << "{}";
  const ProgramResult recorded =
      gelslam({"record", "--from", scan().log().string(), "-o", (run / "log.mkv").string(), "-q"});
  ASSERT_EQ(recorded.exit_code, 0) << recorded.err;
  const ProgramResult result =
      gelslam(replay({(run / "log.mkv").string(), "-o", run.string(), "--overwrite"}));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("holds the input"));
  EXPECT_TRUE(fs::exists(run / "log.mkv"));
  fs::remove(run / "log.mkv");
  EXPECT_EQ(gelslam(replay({scan().log().string(), "--every-frame", "-o", run.string(), "--overwrite", "-q"}))
                .exit_code,
            0);
}

TEST(Replay, WhenItsDisplayDiesTheScanIsSaved) {
  if (!fs::exists("/usr/bin/Xvfb")) GTEST_SKIP() << "no Xvfb";
  const TemporaryFolder folder;
  write_long_log(folder / "log", 1500);
  const std::string number = std::to_string(1000 + ::getpid() % 30000), socket = "/tmp/.X11-unix/X" + number,
                    run = (folder / "run").string();
  const pid_t display = start_program("/usr/bin/Xvfb", {":" + number, "-nolisten", "tcp"}, "/dev/null",
                                      (folder / "xvfb").string());
  while (!fs::exists(socket)) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  ::setenv("DISPLAY", (":" + number).c_str(), 1);
  const pid_t scan_process = start_program(
      GELSLAM_PROGRAM, {"scan", (folder / "log").string(), "--model", scan().model().string(), "-o", run}, "",
      (folder / "err").string());
  ::unsetenv("DISPLAY");
  while (!fs::exists(run + "/session.db")) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  std::this_thread::sleep_for(std::chrono::seconds(3));
  ::kill(display, SIGKILL);
  exit_code_of(display);
  EXPECT_GE(exit_code_of(scan_process), 0) << "no signal ended it";
  EXPECT_THAT(read_bytes(folder / "err"), HasSubstr("the display is gone"));
  EXPECT_TRUE(fs::exists(run + "/trajectory.tum")) << "it is whole";
  fs::remove(socket);
  fs::remove("/tmp/.X" + number + "-lock");
}

TEST(Replay, WithoutADisplayNothingBegins) {
  const TemporaryFolder folder;
  ::unsetenv("DISPLAY");
  ::unsetenv("WAYLAND_DISPLAY");
  const ProgramResult result = gelslam(
      {"scan", scan().log().string(), "--model", scan().model().string(), "-o", (folder / "run").string()});
  expect_mistake(result, "--headless");
  EXPECT_TRUE(folder.names().empty());
}

TEST(Replay, MistakesAreOneLine) {
  const TemporaryFolder folder;
  for (const auto& [arguments, words] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{(folder / "none").string()}, "no such file"},
           {{scan().log().string(), "--seconds", "0"}, "no number from 0.01"},
           {{scan().log().string(), "--camera", "simulated"}, "excludes"},
           {{"--every-frame"}, "requires LOG"},
           {{scan().log().string(), "-o", scan().log().string()}, "exists already"}}) {
    const ProgramResult result = gelslam(replay(arguments));
    expect_mistake(result, words);
  }
}

}  // namespace
}  // namespace gelslam
