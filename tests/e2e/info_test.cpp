#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "../support/data_folder.hpp"
#include "../support/expect_mistake.hpp"
#include "../support/pictures.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using test::data_folder;
using test::ProgramResult;
using test::TemporaryFolder;
using ::testing::HasSubstr;

ProgramResult info(const fs::path& path, bool json = false) {
  std::vector<std::string> arguments{"info", path.string()};
  if (json) arguments.push_back("--json");
  return test::run_program(GELSLAM_PROGRAM, arguments);
}

TEST(Info, ARealDataFolder) {
  const fs::path folder = data_folder() / "sequences/track_coin";
  if (!fs::exists(folder)) GTEST_SKIP() << "no data at " << folder << "; set GELSLAM_DATA";
  const ProgramResult words = info(folder);
  EXPECT_EQ(words.exit_code, 0) << words.err;
  for (const char* part : {"a data folder", "GelSight Mini", "320x240, 25 Hz, 245 frames, 9.8 s",
                           "network 5-32-32-32-2", "235 poses"}) {
    EXPECT_THAT(words.out, HasSubstr(part));
  }
  const ProgramResult result = info(folder, true);
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json.at("log").at("frames"), 245);
  EXPECT_EQ(json.at("model").at("layers").size(), 4u);
  EXPECT_EQ(json.at("truth").at("poses"), 235);
  EXPECT_TRUE(json.at("problems").empty());
}

TEST(Info, AFolderWithProblemsStillSaysWhatIsGood) {
  const TemporaryFolder folder;
  test::write_video(folder / "gelsight.avi", "MJPG", 3, 320, 240, 25.0, /*gray=*/true);
  test::write_bytes(folder / "config.yaml", "device_config:\n  framerat: 25\n");
  test::write_bytes(folder / "true_start_T_currs.npy", "x");
  const ProgramResult result = info(folder.path());
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("320x240, 25 Hz, 3 frames"));
  EXPECT_THAT(result.out,
              HasSubstr("config.yaml:2: device_config.framerat is an unknown key, did you mean framerate?"));
  EXPECT_THAT(result.out, HasSubstr("frame 0: a gray picture"));
  EXPECT_THAT(result.out, HasSubstr("true_start_T_currs.npy: not a usable .npy file"));
}

TEST(Info, ImagesOfTheWrongSize) {
  const TemporaryFolder folder;
  cv::imwrite((folder / "1.png").string(), test::numbered_picture(1, 162, 121));
  const ProgramResult result = info(folder.path(), true);
  EXPECT_EQ(result.exit_code, 1);
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json.at("kind"), "a folder of images");
  EXPECT_THAT(json.at("problems").at(0).get<std::string>(), HasSubstr("is 162x121 pixels"));
}

TEST(Info, ARunFolder) {
  const TemporaryFolder folder;
  test::write_bytes(folder / "report.json", R"({"frames": 245, "partial": false, "stages": {"track": 1}})");
  const ProgramResult result = info(folder.path());
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("frames 245, partial false"));
  EXPECT_THAT(result.out, HasSubstr("holds no mesh.ply"));
  test::write_bytes(folder / "report.json", R"({"frames": 245, )");
  EXPECT_THAT(info(folder.path()).out, HasSubstr("not a JSON object, or truncated"));
}

TEST(Info, DamagedSingleFilesAreMistakes) {
  const TemporaryFolder folder;
  for (const char* name : {"a.pth", "a.yaml", "a.npy", "a.ply", "a.obj", "a.stl", "a.mkv"}) {
    test::write_bytes(folder / name, std::string("\0[[[{:", 6) + std::string(200, '\xff'));
    const ProgramResult result = info(folder / name);
    test::expect_mistake(result, name);
  }
}

}  // namespace
}  // namespace gelslam
