#include "gelslam/sensor/image_input.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"
#include "raw_frames.hpp"

namespace gelslam::test {
namespace {

TEST(FitToProfile, AveragesInsteadOfAliasing) {
  cv::Mat3b stripes(672, 896, cv::Vec3b::all(0));
  for (int u = 0; u < stripes.cols; u += 2) stripes.col(u).setTo(cv::Scalar::all(200));
  cv::Scalar deviation, mean;
  cv::meanStdDev(fit_to_profile(stripes, mini_of(stripes.size()), "x"), mean, deviation);
  EXPECT_NEAR(mean[0], 100, 1);
  EXPECT_LT(deviation[0], 1);
}

/// Their size does not tell whether they were cropped, and a wrong guess gives wrong depths.
TEST(FitToProfile, LargerPicturesOfUnknownCropAreRefusedUnlessTheProfileSaysWhatTheyAre) {
  SensorProfile mini;
  const cv::Mat3b exact = numbered_picture(3, 320, 240);
  cv::Mat3b large;
  cv::resize(exact, large, {}, 2, 2, cv::INTER_NEAREST);
  EXPECT_THAT(message_of([&] { fit_to_profile(large, mini, "f.png"); }),
              HasSubstr("f.png: is 640x480 pixels; GelSight Mini needs 320x240, or the camera's raw image "
                        "(3280x2464); write in device_config of a configuration \"raw_imgw: 640\" and "
                        "\"raw_imgh: 480\" where it is the camera's whole picture, or \"cropped: true\" "
                        "where it was cropped already"));
  EXPECT_THAT(message_of([&] { fit_to_profile(numbered_picture(3, 480, 640), mini, "f.png"); }),
              HasSubstr("is it turned by 90 degrees, or another sensor's?"));
  EXPECT_THAT(message_of([&] { fit_to_profile(numbered_picture(3, 162, 121), mini, "f.png"); }),
              HasSubstr("write in a configuration \"imgw: 162\", \"imgh: 121\", a \"ppmm\" 1.98 times the "
                        "usual one"));
  mini.cropped = true;
  EXPECT_EQ(cv::norm(fit_to_profile(large, mini, "f.png"), exact, cv::NORM_INF), 0) << "nothing is cut";
  EXPECT_EQ(fit_to_profile(numbered_picture(3, 3280, 2464), mini, "x").size(), cv::Size(320, 240));
  EXPECT_THROW(fit_to_profile(numbered_picture(3, 1920, 1080), mini, "x"), Error);
}

TEST(ReadImage, EveryFormatAndAlpha) {
  TemporaryFolder folder;
  const cv::Mat3b picture = numbered_picture(5, 64, 48);
  for (const char* name : {"a.png", "a.bmp", "a.jpg"}) {
    cv::imwrite((folder / name).string(), picture);
    const cv::Mat3b read = read_image(folder / name);
    EXPECT_LT(cv::norm(read, picture, cv::NORM_L1) / (64.0 * 48 * 3), 4.0) << name;
  }
  cv::Mat with_alpha;
  cv::cvtColor(picture, with_alpha, cv::COLOR_BGR2BGRA);
  cv::imwrite(folder / "alpha.png", with_alpha);
  EXPECT_EQ(cv::norm(read_image(folder / "alpha.png"), picture), 0.0);
}

TEST(ReadImage, UnusableImagesAreNamed) {
  TemporaryFolder folder;
  const auto message = [&](const char* name) { return message_of([&] { read_image(folder / name); }); };
  cv::imwrite(folder / "gray1.png", cv::Mat1b(48, 64, uchar{7}));
  cv::imwrite(folder / "gray3.png", cv::Mat3b(48, 64, cv::Vec3b(7, 7, 7)));
  cv::imwrite(folder / "deep.png", cv::Mat(48, 64, CV_16UC3, cv::Scalar(1, 2, 3)));
  write_bytes(folder / "text.png", "hello");
  write_bytes(folder / "empty.png", "");
  EXPECT_THAT(message("gray1.png"), HasSubstr("gray1.png: a gray picture"));
  EXPECT_THAT(message("gray3.png"), HasSubstr("gray3.png: a gray picture"));
  EXPECT_THAT(message("deep.png"), HasSubstr("8 bits per channel"));
  EXPECT_THAT(message("text.png"), HasSubstr("not a readable image (png, jpg or bmp)"));
  write_bytes(folder / "lfs.png", kLfsPointer);
  EXPECT_THAT(message("lfs.png"), HasSubstr(kLfsAdvice));
  EXPECT_THAT(message("empty.png"), HasSubstr("the file is empty"));
  EXPECT_THAT(message("none.png"), HasSubstr("none.png: cannot be read: No such file"));
}

TEST(ReadImage, AHugeHeaderCostsNothing) {
  TemporaryFolder folder;
  struct Kind {
    const char* name;
    std::string before;         // the size
    std::size_t between;        // bytes
    std::string width, height;  // 28000 as the format has it
  };
  const std::string big("\0\0\x6d\x60", 4), little("\x60\x6d\0\0", 4), two("\x6d\x60");
  for (const Kind& kind : {Kind{"a.bmp", "BM", 16, little, little}, Kind{"a.png", "IHDR", 0, big, big},
                           Kind{"a.jpg", "\xff\xc0", 3, two, two}}) {
    cv::imwrite((folder / kind.name).string(), numbered_picture(5, 64, 48));
    std::string bytes = read_bytes(folder / kind.name);
    const std::size_t at = bytes.find(kind.before);
    ASSERT_NE(at, std::string::npos);
    const std::string size = kind.width + kind.height;
    bytes.replace(at + kind.before.size() + kind.between, size.size(), size);
    write_bytes(folder / kind.name, bytes);
    EXPECT_THAT(message_of([&] { read_image(folder / kind.name); }),
                HasSubstr("28000x28000 pixels are more"));
  }
}

}  // namespace
}  // namespace gelslam::test
