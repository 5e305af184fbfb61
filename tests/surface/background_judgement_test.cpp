#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "../support/data_folder.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/surface/background.hpp"
#include "gelslam/surface/model_file.hpp"
#include "linear_gel.hpp"

namespace gelslam::test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

using Warnings = std::vector<std::string>;

/// Returns a picture with a bluish top, a reddish bottom, greenish sides and a bright middle, about like that
/// of a GelSight Mini.
cv::Mat3b bare_gel(int width = 320) {
  return pixel_map<cv::Vec3b>({width, width * 3 / 4}, [&](int u, int v) {
    const double x = 2.0 * u / width - 1, y = 2.0 * v / (width * 3 / 4) - 1,
                 lamp = 0.6 + 0.4 * std::exp(-2 * (x * x + y * y));
    return cv::Vec3d(130 * lamp * std::exp(-0.2 * y), 120 * lamp, 90 * lamp * std::exp(0.3 * y));
  });
}

cv::Mat3b swapped(const cv::Mat3b& image) {
  cv::Mat3b result;
  cv::cvtColor(image, result, cv::COLOR_BGR2RGB);
  return result;
}

cv::Mat3b upside_down(const cv::Mat3b& image) {
  cv::Mat3b result;
  cv::flip(image, result, 0);
  return result;
}

/// Adds some spots of dirt that are 12 % darker than the gel.
cv::Mat3b stained(const cv::Mat3b& image) {
  cv::Mat1f shade(image.size(), 1.0F);
  cv::RNG random(7);
  const int unit = image.cols / 320;
  for (int i = 0; i < 8; ++i) {
    const cv::Point center(random.uniform(30, 290) * unit, random.uniform(30, 210) * unit);
    cv::circle(shade, center, random.uniform(5, 10) * unit, cv::Scalar(0.88), cv::FILLED);
  }
  return shaded(image, shade);
}

/// Adds `columns` by `rows` printed dots, slightly out of line and as dark as ink.
cv::Mat3b with_markers(const cv::Mat3b& image, int columns, int rows, double diameter_px,
                       double light = 0.35) {
  cv::Mat1f ink(image.size(), 0.0F);
  cv::RNG random(3);
  const int unit = image.cols / 320;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const double u = (column + 0.5) * image.cols / columns + random.uniform(-1.0, 1.0) * unit,
                   v = (row + 0.5) * image.rows / rows + random.uniform(-1.0, 1.0) * unit;
      cv::circle(ink, cv::Point2d(u, v), cvRound(0.5 * diameter_px * unit), cv::Scalar(1), cv::FILLED);
    }
  }
  cv::GaussianBlur(ink, ink, cv::Size(), unit, unit);
  return shaded(image, cv::Mat1f(1.0 - (1.0 - light) * ink));
}

/// Adds dark specks at random places, as many as there may be printed dots.
cv::Mat3b with_dirt(const cv::Mat3b& image, int count) {
  cv::Mat3b result = image.clone();
  cv::RNG random(5);
  for (int k = 0; k < count; ++k)
    cv::circle(result, {random.uniform(8, image.cols - 8), random.uniform(8, image.rows - 8)},
               random.uniform(2, 6), cv::Scalar(40, 40, 35), cv::FILLED);
  return result;
}

/// Adds a cut across the gel that is three pixels wide.
cv::Mat3b torn(const cv::Mat3b& image) {
  cv::Mat3b result = image.clone();
  const int unit = image.cols / 320;
  cv::line(result, cv::Point(60, 200) * unit, cv::Point(250, 90) * unit, cv::Scalar(50, 50, 40), 3 * unit);
  return result;
}

/// Expects that each warning fits into a line of a terminal, and returns the warnings.
Warnings short_ones(Warnings warnings) {
  for (const std::string& warning : warnings) EXPECT_LE(warning.size(), 120U) << warning;
  return warnings;
}

Warnings judge(const cv::Mat3b& image) { return short_ones(judge_background(image, "GelSight Mini")); }

TEST(JudgeBackground, ABareGelIsNotDoubted) {
  EXPECT_THAT(judge(bare_gel()), IsEmpty());
  EXPECT_THAT(judge(bare_gel(640)), IsEmpty());
}

TEST(JudgeBackground, LampsThatLieOtherwiseAreNamed) {
  EXPECT_THAT(judge(swapped(bare_gel())), ElementsAre(HasSubstr("red and blue seem to be swapped")));
  EXPECT_THAT(judge(upside_down(bare_gel())), ElementsAre(HasSubstr("upside down")));
  EXPECT_THAT(judge(swapped(upside_down(bare_gel()))), ElementsAre(HasSubstr("red outweighs blue")));
  EXPECT_THAT(judge(cv::Mat3b(240, 320, cv::Vec3b(120, 90, 60))),
              ElementsAre(HasSubstr("is it the right camera")));
  EXPECT_THAT(judge_background(swapped(bare_gel()), "DIGIT"), IsEmpty()) << "its lamps are not known";
}

TEST(JudgeBackground, ExposureAndColor) {
  EXPECT_THAT(judge(cv::Mat3b(bare_gel() * 0.4)), ElementsAre(HasSubstr("very dark")));
  EXPECT_THAT(judge(cv::Mat3b(bare_gel() * 2.2)), Contains(HasSubstr("saturated")));
  EXPECT_THAT(judge(cv::Mat3b(240, 320, cv::Vec3b(90, 90, 90))), ElementsAre(HasSubstr("no color")));
  EXPECT_THAT(judge(cv::Mat3b(240, 320, cv::Vec3b(0, 0, 0))),
              ElementsAre(HasSubstr("very dark"), HasSubstr("no color")));
}

TEST(JudgeBackground, TheMakersModelIsNamedOnceWithItsAccuracy) {
  GradientModel model;
  WideNetwork& makers = model.wide.emplace();
  makers = {{{5, 64, 64, 64, 2}}, true, std::vector<float>(8834)};
  makers.numbers[8832] = 0.4F;  // reads a slope everywhere, as it does on real gels
  EXPECT_THAT(judge_background(bare_gel(), "GelSight Mini", &model),
              ElementsAre(AllOf(HasSubstr("the maker's"), HasSubstr("gelslam calibrate"))));
}

TEST(JudgeBackground, APitchThatDisagreesWithThePrintedDotsIsSaid) {
  const cv::Mat3b gel = with_markers(bare_gel(), 9, 7, 9);
  const double right_mm = 2.0 / find_marker_dots(gel)->spacing_px;
  const auto judge_at = [&](double pitch_mm, const char* device = "GelSight Mini") {
    return short_ones(judge_background(gel, device, nullptr, pitch_mm));
  };
  EXPECT_THAT(judge_at(1.05 * right_mm), ElementsAre(HasSubstr("63 markers")));
  EXPECT_THAT(judge_at(1.4 * right_mm),
              Contains(AllOf(HasSubstr(fmt::format("ppmm is {:.4f}: set it in the configuration", right_mm)),
                             HasSubstr("1.40 times too large"))));
  EXPECT_THAT(judge_at(0.8 * right_mm), Contains(HasSubstr("1.25 times too small")));
  EXPECT_THAT(judge_at(1.4 * right_mm, "DIGIT"), ElementsAre(HasSubstr("63 markers")))
      << "its dots are not known";
}

TEST(JudgeBackground, DirtAndTears) {
  for (const int width : {320, 640}) {
    EXPECT_THAT(judge(stained(bare_gel(width))), ElementsAre(HasSubstr("differ sharply"))) << width;
    EXPECT_THAT(judge(torn(bare_gel(width))), ElementsAre(HasSubstr("differ sharply"))) << width;
  }
}

TEST(JudgeBackground, Markers) {
  EXPECT_THAT(judge(with_markers(bare_gel(), 9, 7, 9)), ElementsAre(HasSubstr("the gel has 63 markers, 3")));
  const auto dense = find_marker_dots(with_markers(bare_gel(), 16, 12, 11));
  ASSERT_TRUE(dense);
  EXPECT_FALSE(dense->are_readable());
  EXPECT_THAT(dense->sentence(), HasSubstr("too little is left"));
  const auto large = find_marker_dots(with_markers(bare_gel(640), 8, 6, 7));
  ASSERT_TRUE(large);
  EXPECT_EQ(large->count, 48);
  EXPECT_NEAR(large->spacing_px, 80.0, 3.0);
  EXPECT_NEAR(large->diameter_px, 14.0, 3.0);
  EXPECT_FALSE(find_marker_dots(bare_gel()));
  for (const int specks : {12, 30, 60})
    EXPECT_FALSE(find_marker_dots(with_dirt(bare_gel(), specks))) << specks;
  EXPECT_FALSE(find_marker_dots(torn(bare_gel())));
  EXPECT_FALSE(find_marker_dots(cv::Mat3b(8, 8, cv::Vec3b(0, 0, 0))));
}

TEST(JudgeBackground, NoPictureIsAMistake) {
  EXPECT_THROW(judge(cv::Mat3b()), Error);
  EXPECT_THROW(judge(cv::Mat3b(20, 320)), Error);
  EXPECT_THAT(judge(cv::Mat3b(32, 32, cv::Vec3b(0, 0, 0))), Contains(HasSubstr("very dark")));
}

class RealBackgrounds : public ::testing::Test {
 protected:
  struct Sensor {
    std::string name;
    cv::Mat3b background;
    std::optional<GradientModel> model;
  };

  void SetUp() override {
    const fs::path data = data_folder();
    if (!fs::exists(data / "sequences")) GTEST_SKIP() << "no data in " << data << "; set GELSLAM_DATA";
    for (const char* name : {"calibration", "calibration_b", "calibration_sim"}) {
      sensors.push_back({name, cv::imread((data / name / "background.png").string()),
                         read_model(data / name / "model/nnmodel.pth")});
    }
    sensors.push_back(
        {"frames", cv::imread(data / "frames/background.png"), read_model(data / "frames/nnmodel.pth")});
    cv::Mat3b clip;
    cv::resize(cv::imread(data / "clips/background.png"), clip, cv::Size(320, 240), 0, 0, cv::INTER_CUBIC);
    sensors.push_back({"clips", clip, std::nullopt});
    for (const fs::directory_entry& entry : fs::directory_iterator(data / "sequences")) {
      if (!entry.is_directory()) continue;
      cv::VideoCapture video(entry.path() / "gelsight.avi");
      std::vector<cv::Mat3b> frames;
      for (cv::Mat frame; frames.size() < 10 && video.read(frame);) frames.push_back(frame.clone());
      if (!frames.empty())
        sensors.push_back({entry.path().filename().string(), mean_image(frames), sensors[2].model});
    }
  }

  std::vector<Sensor> sensors;
};

TEST_F(RealBackgrounds, GoodOnesAreNotDoubted) {
  ASSERT_GE(sensors.size(), 20u);
  for (const Sensor& sensor : sensors)
    EXPECT_THAT(judge_background(sensor.background, "GelSight Mini R0B 28KX",
                                 sensor.model ? &*sensor.model : nullptr),
                IsEmpty())
        << sensor.name;
}

TEST_F(RealBackgrounds, AnotherSensorsModelIsNoticed) {
  const Sensor &a = sensors[0], &b = sensors[1];
  EXPECT_THAT(judge_background(a.background, "GelSight Mini", &*b.model),
              ElementsAre(HasSubstr("is it this sensor's")));
  EXPECT_THAT(judge_background(b.background, "GelSight Mini", &*a.model),
              ElementsAre(HasSubstr("is it this sensor's")));
}

}  // namespace
}  // namespace gelslam::test
