#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "../sensor/raw_frames.hpp"
#include "../support/data_folder.hpp"
#include "../support/pictures.hpp"
#include "../support/run_program.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using namespace test;
using ::testing::HasSubstr;
using ::testing::Not;

/// A log as a camera would make it: bluish top and reddish bottom, which start_check does not warn of.
void write_source(const fs::path& path, int frames) {
  cv::Mat3b picture(240, 320);
  for (int v = 0; v < 240; ++v) picture.row(v).setTo(cv::Scalar(130 - v / 4.0, 105, 60 + v / 6.0));
  LogWriter writer(path, {"GelSight Mini of the test", "gain 3\n", "", ""}, 25);
  for (int i = 0; i < frames; ++i) {
    std::vector<std::uint8_t> jpeg;
    cv::imencode(".jpg", picture + cv::Scalar::all(i % 40), jpeg);  // no two in a row alike
    ASSERT_TRUE(writer.write(raw_frame(FrameEncoding::jpeg, jpeg, picture.size(), i)));
  }
}

TEST(Record, TheSimulatedCameraWithItsModel) {
  const TemporaryFolder folder;
  const std::string log = (folder / "log.mkv").string();
  const ProgramResult result =
      gelslam({"record", "--camera", "simulated", "--seconds", "1", "-o", log, "-q"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const ProgramResult info = gelslam({"info", log});
  EXPECT_THAT(info.out, testing::HasSubstr("network of 2370 weights"));
  EXPECT_EQ(info.exit_code, 0) << info.out;
}

TEST(Record, CopiesALogByteByByte) {
  const TemporaryFolder folder;
  write_source(folder / "a.mkv", 60);
  const ProgramResult result =
      gelslam({"record", "--from", (folder / "a.mkv").string(), "-o", (folder / "b.mkv").string()});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, HasSubstr("recorded 60 frames in 2.4 s (25.00 Hz), 0 lost by the camera"));
  EXPECT_THAT(result.err, Not(HasSubstr("warning")));
  const std::vector<RawFrame> a = read_all(*open_raw_log(folder / "a.mkv")),
                              b = read_all(*open_raw_log(folder / "b.mkv"));
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].bytes, b[i].bytes);
    EXPECT_EQ(a[i].time_s, b[i].time_s);
  }
  const LogAttachments stored = read_log_attachments(folder / "b.mkv");
  EXPECT_EQ(stored.sensor, "GelSight Mini of the test");
  EXPECT_EQ(stored.camera_settings, "gain 3\n");
  EXPECT_THAT(stored.config_yaml, HasSubstr("device_config"));
}

TEST(Record, OfTwoVideoTracksTheFirstIsSaidOrOneIsNamed) {
  const TemporaryFolder folder;
  for (const auto& [name, frames] : {std::pair{"a.avi", 5}, std::pair{"b.avi", 9}})
    write_video(folder / name, "MJPG", frames, 320, 240);
  const std::string two = folder / "two.mkv", one = folder / "one.mkv";
  const std::string join = "ffmpeg -v error -i " + (folder / "a.avi").string() + " -i " +
                           (folder / "b.avi").string() + " -map 0 -map 1 -c copy " + two;
  if (std::system(join.c_str()) != 0) GTEST_SKIP() << "needs ffmpeg";
  const ProgramResult first = gelslam({"info", two});
  EXPECT_THAT(first.out, HasSubstr("5 frames over"));
  EXPECT_THAT(first.out, HasSubstr("has 2 video tracks; this is the first (video_track takes another)"));
  EXPECT_THAT(gelslam({"info", two, "--track", "2"}).out,
              HasSubstr("9 frames over 0.32 s, 0 lost by the camera; whole"));
  expect_mistake(gelslam({"info", two, "--track", "3"}), "has 2 video tracks, and no track 3");
  EXPECT_THAT(gelslam({"record", "--from", two, "--track", "2", "-o", one}).err,
              HasSubstr("recorded 9 frames"));
  EXPECT_THAT(gelslam({"info", one}).out, HasSubstr("9 frames over"));
}

TEST(Record, MistakesAreOneLineAndLeaveNothing) {
  const TemporaryFolder folder;
  write_source(folder / "a.mkv", 3);
  const std::string from = (folder / "a.mkv").string(), to = (folder / "b.mkv").string();
  struct Mistake {
    std::vector<std::string> arguments;
    const char* words;
  };
  for (const Mistake& mistake :
       {Mistake{{"--from", from, "-o", from}, "exists already"},
        Mistake{{"--from", to + "x", "-o", to}, "no such file or folder"},
        Mistake{{"--from", from, "-o", (folder / "no/b.mkv").string()}, "cannot be created"},
        Mistake{{"--from", from, "-o", to, "--model", from}, "holds no gradient model"},
        Mistake{{"--from", from, "-o", to, "--seconds", "-3"}, "no number from 0.01"},
        Mistake{{"--from", from, "-o", to, "--keep-free", "-1"}, "-1 is no size"},
        Mistake{{"--from", from, "--camera", "0"}, "excludes"}}) {
    std::vector<std::string> arguments{"record"};
    arguments.insert(arguments.end(), mistake.arguments.begin(), mistake.arguments.end());
    const ProgramResult result = gelslam(arguments);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(mistake.words));
  }
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.mkv"});
}

TEST(Record, InfoSaysWhatIsInALog) {
  const TemporaryFolder folder;
  write_source(folder / "a.mkv", 30);
  const std::string whole = read_bytes(folder / "a.mkv");
  write_bytes(folder / "cut.mkv", whole.substr(0, whole.size() / 2));
  const ProgramResult words = gelslam({"info", (folder / "a.mkv").string()});
  EXPECT_EQ(words.exit_code, 0) << words.out << words.err;
  for (const char* part : {"a recorded log", "30 frames over 1.16 s", "whole"})
    EXPECT_THAT(words.out, HasSubstr(part));
  const auto json = nlohmann::json::parse(gelslam({"info", (folder / "cut.mkv").string(), "--json"}).out);
  const auto readable = json.at("readable").get<std::string>();
  EXPECT_THAT(readable, testing::StartsWith(
                            std::to_string(read_all(*open_raw_log(folder / "cut.mkv")).size()) + " frames"));
  EXPECT_THAT(json.at("problems").at(0).get<std::string>(), HasSubstr("of 30 frames"));
  EXPECT_EQ(gelslam({"info", (folder / "cut.mkv").string()}).exit_code, 1);
  const std::string shown = GELSLAM_PROGRAM " info " + (folder / "a.mkv").string();
  EXPECT_THAT(on_terminal(shown), HasSubstr("100%  30/30"));
  EXPECT_THAT(on_terminal(shown + " -q"), testing::Not(HasSubstr("30/30")));
}

}  // namespace
}  // namespace gelslam
