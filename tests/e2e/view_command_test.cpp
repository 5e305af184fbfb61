// gelslam view from the command line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "run_program.hpp"
#include "view_run.hpp"

namespace gelslam::test {
namespace {

class ViewCommand : public testing::Test {
 protected:
  void SetUp() override { write_run(folder_ / "RUN", 4); }
  ProgramResult view(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "view");
    return gelslam(arguments);
  }
  void expect_mistake(const std::vector<std::string>& arguments, const std::string& words) const {
    const ProgramResult result = view(arguments);
    test::expect_mistake(result, words);
    EXPECT_EQ(folder_.names(), std::vector<std::string>{"RUN"}) << "nothing is left behind";
  }
  TemporaryFolder folder_;
  const std::string run_ = (folder_ / "RUN").string(), png_ = (folder_ / "x.png").string();
};

TEST_F(ViewCommand, WritesAPictureOfTheSizeAskedFor) {
  const ProgramResult result = view({run_, "--compare", run_, "--time", "1.5", "--graph", "--missing",
                                     "--size", "320x200", "--snapshot", png_});
  if (result.err.find("cannot draw") != std::string::npos) GTEST_SKIP() << result.err;
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const cv::Mat picture = cv::imread(png_);
  EXPECT_EQ(picture.size(), cv::Size(320, 200));
  cv::Scalar mean, deviation;
  cv::meanStdDev(picture, mean, deviation);
  EXPECT_GT(deviation[1], 15) << "more than background";
}

/// Sanitizers reserve more than these limits.
TEST_F(ViewCommand, WithLittleMemoryItEndsByItself) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP();
#endif
  for (const char* kilobytes : {"500000", "550000", "600000", "620000", "700000", "760000"})
    for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
             {"info", run_}, {"view", run_, "--snapshot", png_, "--overwrite"}}) {
      std::vector<std::string> arguments{"-c", "ulimit -v $0; exec \"$@\"", kilobytes, GELSLAM_PROGRAM};
      arguments.insert(arguments.end(), words.begin(), words.end());
      EXPECT_GE(run_program("/bin/sh", arguments).exit_code, 0) << words[0] << " in kB: " << kilobytes;
    }
}

TEST_F(ViewCommand, MistakesAreOneLine) {
  expect_mistake({(folder_ / "nowhere").string(), "--snapshot", png_}, "no such file or folder");
  expect_mistake({"--snapshot", png_}, "SOURCE is required");
  expect_mistake({run_, "--size", "9x", "--snapshot", png_}, "--size 9x");
  expect_mistake({run_, "--size", "100000x10", "--snapshot", png_}, "16 to 8192");
  expect_mistake({run_, "--color", "distance", "--snapshot", png_}, "--compare or --truth");
  expect_mistake({run_ + "/mesh.ply", "--time", "1", "--snapshot", png_},
                 "--time and --missing need a run folder");
  expect_mistake({run_, "--truth", run_, "--snapshot", png_}, "true_start_T_currs");
  expect_mistake({run_, "--snapshot", png_ + ".jpg"}, "ends in .png");
}

}  // namespace
}  // namespace gelslam::test
