// The program on the real recordings of data/real: what its README expects of them.

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "../support/data_folder.hpp"
#include "../support/run_program.hpp"
#include "../support/temporary_folder.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

class RealRecordings : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(real)) GTEST_SKIP() << "no " << real << "; set GELSLAM_DATA";
    test::write_bytes(folder / "dots.yaml",
                      "device_config:\n  ppmm: 0.0453\n  raw_imgw: 320\n  raw_imgh: 240\n");
  }

  test::ProgramResult run(std::vector<std::string> words) const {
    return test::run_program(GELSLAM_PROGRAM, std::move(words));
  }

  /// One JSON object for every frame.
  std::vector<nlohmann::json> track(const fs::path& log, std::vector<std::string> options) const {
    std::vector<std::string> words{"track", log.string(), "--format", "ndjson"};
    words.insert(words.end(), options.begin(), options.end());
    const test::ProgramResult result = run(words);
    EXPECT_LE(result.exit_code, 1) << log << ": " << result.err;
    std::vector<nlohmann::json> frames;
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) {
      nlohmann::json json = nlohmann::json::parse(line, nullptr, false);
      if (json.is_object() && json.contains("status")) frames.push_back(std::move(json));
    }
    return frames;
  }

  const fs::path data = test::data_folder(), real = data / "real";
  const test::TemporaryFolder folder;
};

TEST_F(RealRecordings, AFingerIsTrackedHoweverItsClipIsEncoded) {
  for (const char* clip : {"finger.avi", "finger_x264.mp4"}) {
    const auto frames =
        track(real / "finger" / clip, {"--model", (data / "calibration/model/nnmodel.pth").string()});
    const auto tracked = std::count_if(frames.begin(), frames.end(),
                                       [](const nlohmann::json& f) { return f.at("status") == "tracked"; });
    EXPECT_EQ(frames.size(), 306U) << clip;
    EXPECT_GE(tracked, 205) << clip;
  }
}

/// Their first pictures are dark, or old ones from the camera's buffers. When the object comes was seen by
/// eye; before, the gel is bare.
TEST_F(RealRecordings, NoBareGelIsTrackedAfterABadStart) {
  const std::map<std::string, int> touched_at{
      {"blue_mug_1", 19}, {"cheese_tube_3", 27}, {"jute_basket_2", 34},   {"marker_pen_3", 30},
      {"tin_box_1", 18},  {"usb_hub_1", 33},     {"wooden_giraffe_3", 33}};
  for (const auto& [name, touch] : touched_at) {
    const auto frames =
        track(real / "bad_starts" / (name + "_camera_0.avi"),
              {"--model", (real / "nnmini.pt").string(), "--config", (folder / "dots.yaml").string()});
    EXPECT_GT(frames.size(), 70U) << name;
    for (const nlohmann::json& frame : frames) {
      if (frame.at("frame") >= touch) break;
      EXPECT_NE(frame.at("status"), "tracked") << name << " " << frame.at("frame");
    }
  }
}

/// What a newcomer reads: lines of a terminal, each once.
TEST_F(RealRecordings, WarningsAreShortAndSaidOnce) {
  const std::string dots = (folder / "dots.yaml").string(), maker = (real / "nnmini.pt").string(),
                    model = (data / "calibration/model/nnmodel.pth").string(),
                    out = (folder / "RUN").string();
  const std::vector<std::vector<std::string>> logs = {
      {(real / "finger/finger.avi").string(), "--model", model},
      {(real / "bare_gel/tin_box_1_right.avi").string(), "--model", maker, "--config", dots, "--background",
       (real / "bare_gel/tin_box_1_background.png").string()},
      {(real / "bad_starts/blue_mug_1_camera_0.avi").string(), "--model", maker, "--config", dots}};
  for (std::vector<std::string> words : logs) {
    words.insert(words.begin(), "reconstruct");
    words.insert(words.end(), {"-o", out, "--overwrite"});
    std::istringstream lines(run(words).err);
    std::set<std::string> warnings;
    for (std::string line; std::getline(lines, line);) {
      if (!line.starts_with("warning: ")) continue;
      EXPECT_TRUE(warnings.insert(line).second) << line;
      EXPECT_LE(line.size(), std::string("warning: ").size() + 120) << line;
    }
    EXPECT_FALSE(warnings.empty()) << words[1];
    for (const char* command : {"fuse", "export", "view"}) {
      std::vector<std::string> again = {command, out};
      if (*command == 'e') again.insert(again.end(), {"-o", (folder / "mesh.stl").string(), "--overwrite"});
      if (*command == 'v')
        again.insert(again.end(), {"--snapshot", (folder / "view.png").string(), "--overwrite"});
      const std::string said = run(again).err;
      EXPECT_EQ(said.find("warning: "), std::string::npos) << said;
      EXPECT_NE(said.find("the run has warnings: gelslam info " + out), std::string::npos) << said;
    }
  }
}

TEST_F(RealRecordings, ABackgroundCanBeNamed) {
  const auto frames = track(real / "bad_starts/tin_box_1_camera_0.avi",
                            {"--model", (real / "nnmini.pt").string(), "--config",
                             (folder / "dots.yaml").string(), "--background-frames", "5-9"});
  ASSERT_GT(frames.size(), 100U);
  EXPECT_EQ(frames[9].at("status"), "background");
  EXPECT_EQ(frames[10].at("status"), "no_contact");
}

}  // namespace
}  // namespace gelslam
