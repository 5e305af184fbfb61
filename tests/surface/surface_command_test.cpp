// `gelslam surface` as a person runs it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "../support/run_program.hpp"
#include "gelslam/core/npy.hpp"
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
    write_picture("background.png", render(cv::Mat1f(kSensor, 0.0F), kPitchMm, 0.0, 1));
    truth_ = ball_press(kSensor, kPitchMm, 150, 110, 4.0, 0.5);
    write_picture("touch.png", render(truth_, kPitchMm, 0.5, 2));
  }

  void write_picture(const std::string& name, const cv::Mat& image) {
    cv::imwrite((folder_ / name).string(), image);
  }

  ProgramResult run(const std::string& image, const std::vector<std::string>& more = {},
                    const std::string& background = "background.png") {
    std::vector<std::string> arguments = {"surface",      (folder_ / image).string(),
                                          "--background", (folder_ / background).string(),
                                          "--model",      (folder_ / "nnmodel.pth").string(),
                                          "-o",           (folder_ / "OUT").string(),
                                          "--pitch",      "0.05"};
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
