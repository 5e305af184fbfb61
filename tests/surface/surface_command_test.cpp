// `gelslam surface` as a person runs it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "../support/data_folder.hpp"
#include "../support/run_program.hpp"
#include "gelslam/core/npy.hpp"
#include "gelslam/core/sensor_optics.hpp"
#include "linear_gel.hpp"
#include "pth_file.hpp"

namespace gelslam::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kPitchMm = 0.05;
const cv::Size kSensor(320, 240);

class SurfaceCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    PthFile file;
    file.layers = layers_of(linear_gel_model());
    write_bytes(folder_ / "nnmodel.pth", zip_archive(file.entries()));
    write_optics(folder_ / kOpticsFileName, {});  // as they are rendered
    write_bytes(folder_ / "sensor.yaml", "device_config:\n  ppmm: 0.05\n");
    write_picture("background.png", render(cv::Mat1f(kSensor, 0.0F), kPitchMm, 0.0, 1));
    truth_ = ball_press(kSensor, kPitchMm, 150, 110, 4.0, 0.5);
    write_picture("touch.png", render(truth_, kPitchMm, 0.5, 2));
  }

  void write_picture(const std::string& name, const cv::Mat& image) {
    cv::imwrite((folder_ / name).string(), image);
  }

  ProgramResult run(const std::string& image, const std::vector<std::string>& more = {},
                    const std::string& background = "background.png") {
    std::vector<std::string> arguments = {
        "surface",  (folder_ / image).string(),         "--background", (folder_ / background).string(),
        "--model",  (folder_ / "nnmodel.pth").string(), "-o",           (folder_ / "OUT").string(),
        "--config", (folder_ / "sensor.yaml").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(GELSLAM_PROGRAM, arguments);
  }

  void expect_mistake(const ProgramResult& result, const std::string& expected) {
    test::expect_mistake(result, expected);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "OUT"));
  }

  TemporaryFolder folder_;
  cv::Mat1f truth_;
};

TEST_F(SurfaceCommand, WritesTheHeightAndItsPictures) {
  const ProgramResult result = run("touch.png");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("contact "));
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "OUT"))
    names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  EXPECT_THAT(names, ElementsAre("contact.png", "curvature.png", "height.png", "height_mm.npy", "normals.png",
                                 "surface.ply"));
  const NpyArray height = read_npy(folder_ / "OUT" / "height_mm.npy");
  ASSERT_THAT(height.shape, ElementsAre(240U, 320U));
  EXPECT_EQ(height.type, NpyType::float32);
  std::vector<double> heights_mm = height.to_doubles();
  cv::Mat1d truth_mm;
  truth_.convertTo(truth_mm, CV_64F);
  EXPECT_LT(cv::norm(cv::Mat1d(240, 320, heights_mm.data()), truth_mm, cv::NORM_INF), 0.02);
  const cv::Mat contact = cv::imread((folder_ / "OUT" / "contact.png").string(), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(contact.at<unsigned char>(110, 150), 255);
  EXPECT_EQ(contact.at<unsigned char>(10, 10), 0);
  const cv::Mat3b normals = cv::imread((folder_ / "OUT" / "normals.png").string());
  EXPECT_LT(normals(110, 180)[2], 110);  // red is x: right of the dent's center the surface rises, so n_x < 0
  const std::string ply = read_bytes(folder_ / "OUT" / "surface.ply").substr(0, 1000);
  EXPECT_THAT(ply, HasSubstr("element vertex 76800"));
  EXPECT_THAT(ply, HasSubstr("element face 152482"));
}

TEST_F(SurfaceCommand, SaysHowRoundTheMiddleIs) {
  EXPECT_THAT(run("touch.png").out, HasSubstr("; its middle is round as a ball of "));
  double found_mm = 0;
  const std::string out = run("touch.png", {"--overwrite"}).out;
  std::sscanf(out.c_str() + out.find("ball of "), "ball of %lf", &found_mm);
  EXPECT_NEAR(found_mm, 8.0, 0.4);  // what docs/getting-started.md compares, within 5 %
}

TEST_F(SurfaceCommand, TheConfigurationNamesModelSizeAndPitch) {
  write_bytes(folder_ / "other.yaml",
              "device_config:\n  device_name: DIGIT\n  imgw: 160\n  imgh: 120\n  raw_imgw: 160\n  "
              "raw_imgh: 120\n  cropped: true\n  ppmm: 0.1\n  calibration_model_path: nnmodel.pth\n");
  const auto surface = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {
        "surface", (folder_ / "touch.png").string(), "--background", (folder_ / "background.png").string(),
        "-o",      (folder_ / "OUT").string(),       "--overwrite"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(GELSLAM_PROGRAM, arguments);
  };
  const ProgramResult result = surface({"--config", (folder_ / "other.yaml").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(cv::imread((folder_ / "OUT/height.png").string()).size(), cv::Size(160, 120));
  test::expect_mistake(surface({}), "no gradient model");
}

// What the first frames of a log are asked, and whether both pictures belong together.
TEST_F(SurfaceCommand, ChecksPictureAndBackground) {
  expect_mistake(run("touch.png", {}, "touch.png"), "should show the bare gel, but the gel already shows");
  write_picture("dark.png", cv::Mat3b(cv::imread((folder_ / "touch.png").string()) * 0.05));
  const ProgramResult dark = run("dark.png", {"--overwrite"});
  EXPECT_EQ(dark.exit_code, 1);
  EXPECT_THAT(dark.err, HasSubstr("does not look like the background"));
}

TEST_F(SurfaceCommand, RefusesRealPicturesTurnedOrWithRedAndBlueSwapped) {
  const auto presses = data_folder() / "calibration";
  if (!std::filesystem::exists(presses)) GTEST_SKIP() << "no " << presses << "; set GELSLAM_DATA";
  const cv::Mat3b bare = cv::imread((presses / "background.png").string()),
                  touch = cv::imread((presses / "6.310mm/0/gelsight.png").string());
  write_picture("bare.png", bare);
  write_picture("lit.png", touch);
  cv::Mat turned, swapped;
  cv::rotate(bare, turned, cv::ROTATE_180);
  write_picture("bare_turned.png", turned);
  cv::cvtColor(bare, swapped, cv::COLOR_BGR2RGB);
  write_picture("bare_swapped.png", swapped);
  cv::rotate(touch, turned, cv::ROTATE_180);
  write_picture("turned.png", turned);
  cv::cvtColor(touch, swapped, cv::COLOR_BGR2RGB);
  write_picture("swapped.png", swapped);
  expect_mistake(run("lit.png", {}, "bare_turned.png"),
                 "bare_turned.png': the picture seems to be upside down");
  expect_mistake(run("lit.png", {}, "bare_swapped.png"),
                 "bare_swapped.png': red and blue seem to be swapped");
  expect_mistake(run("turned.png", {}, "bare.png"), "upside down");
  expect_mistake(run("swapped.png", {}, "bare.png"), "red and blue seem to be swapped");
  EXPECT_LE(run("turned.png", {"--force"}, "bare.png").exit_code, 1);
}

TEST_F(SurfaceCommand, SaysSoWhenNothingTouches) {
  const ProgramResult result = run("background.png");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("contact 0 pixels"));
}

TEST_F(SurfaceCommand, ReplacesOnlyOnRequestAndOnlyItsOwnFolder) {
  ASSERT_EQ(run("touch.png").exit_code, 0);
  EXPECT_EQ(run("touch.png").exit_code, 2);
  EXPECT_EQ(run("touch.png", {"--overwrite"}).exit_code, 0);
  std::filesystem::remove(folder_ / "OUT" / "height_mm.npy");
  EXPECT_EQ(run("touch.png", {"--overwrite"}).exit_code, 2);
}

TEST_F(SurfaceCommand, RefusesImagesThatDoNotFit) {
  write_picture("small.png", cv::Mat3b(100, 100, cv::Vec3b(10, 60, 200)));
  expect_mistake(run("small.png"), "small.png");
  expect_mistake(run("touch.png", {}, "small.png"), "small.png");
  write_picture("gray.png", cv::Mat3b(kSensor, cv::Vec3b::all(90)));
  expect_mistake(run("gray.png"), "gray picture");
  expect_mistake(run("touch.png", {}, "gray.png"), "gray picture");
  expect_mistake(run("nothing.png"), "nothing.png");
  write_bytes(folder_ / "nnmodel.pth", "no model");
  expect_mistake(run("touch.png"), "neither an nnmodel.pth");
}

}  // namespace
}  // namespace gelslam::test
