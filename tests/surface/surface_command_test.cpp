// Tests the command `gelslam surface`.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <opencv2/imgcodecs.hpp>

#include "../support/run_program.hpp"
#include "gelslam/core/npy.hpp"
#include "gelslam/core/sensor_optics.hpp"
#include "linear_gel.hpp"

namespace gelslam::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kFinerMm = 0.05;

class SurfaceCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    write_pth_model(folder_ / "nnmodel.pth", linear_gel_model());
    write_optics(folder_ / kOpticsFileName, {});  // as they are rendered
    write_bytes(folder_ / "sensor.yaml", "device_config:\n  ppmm: 0.05\n");
    write_picture("background.png", render(cv::Mat1f(kSensor, 0.0F), kFinerMm, 0.0, 1));
    truth_ = ball_press(kSensor, kFinerMm, 150, 110, 4.0, 0.5);
    write_picture("touch.png", render(truth_, kFinerMm, 0.5, 2));
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
    return gelslam(arguments);
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
  EXPECT_THAT(names_in(folder_ / "OUT"), ElementsAre("contact.png", "curvature.png", "height.png",
                                                     "height_mm.npy", "normals.png", "surface.ply"));
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
  const std::string out = run("touch.png").out;
  ASSERT_THAT(out, HasSubstr("; its middle is round as a ball of "));
  double found_mm = 0, sigma_mm = 0;
  std::sscanf(out.c_str() + out.find("ball of "), "ball of %lf +- %lf", &found_mm, &sigma_mm);
  EXPECT_NEAR(found_mm, 8.0, 0.4);
  EXPECT_NEAR(found_mm, 8.0, 2 * sigma_mm);
  EXPECT_LT(sigma_mm, 0.8) << "the model reads this gel's slopes right";
}

// The background is checked like the first frames of a log, and must belong to the same sensor as the
// picture.
TEST_F(SurfaceCommand, ChecksPictureAndBackground) {
  EXPECT_THAT(run("touch.png", {}, "touch.png").err, HasSubstr("the background shows contact"));
  write_picture("dark.png", cv::Mat3b(cv::imread((folder_ / "touch.png").string()) * 0.05));
  const ProgramResult dark = run("dark.png", {"--overwrite"});
  EXPECT_EQ(dark.exit_code, 1);
  EXPECT_THAT(dark.err, HasSubstr("does not look like the background"));
}

TEST_F(SurfaceCommand, ReplacesOnlyOnRequestAndOnlyItsOwnFolder) {
  ASSERT_EQ(run("touch.png").exit_code, 0);
  EXPECT_EQ(run("touch.png").exit_code, 2);
  EXPECT_EQ(run("touch.png", {"--overwrite"}).exit_code, 0);
  std::filesystem::remove(folder_ / "OUT" / "height_mm.npy");
  EXPECT_EQ(run("touch.png", {"--overwrite"}).exit_code, 2);
}

}  // namespace
}  // namespace gelslam::test
