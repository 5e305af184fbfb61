// The live window at a scan's end, and the files that a scan leaves.

#include <opencv2/imgcodecs.hpp>

#include "live_window_fixture.hpp"

namespace gelslam::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST_F(Window, FinishedSaysHowGoodItIs) {
  scan(8);
  session_.figures().saved_drift_mm = 0.034;
  session_.figures().saved_drift_deg = 0.2;
  session_.stop();
  session_.say(LivePhase::finished, "");
  const cv::Mat3b shown = picture("end");
  for (const char* text : {"0.03 mm, 0.2", "nothing"}) expect_text(shown, text, theme::kText);
  EXPECT_NE(find("Keyframes"), nullptr);
  expect_text(shown, " mm", theme::kText);
  EXPECT_NE(find("Size"), nullptr);
  EXPECT_NE(find("gelslam export"), nullptr);
  session_.figures().components = 3;
  expect_text(picture("end_with_pieces"), "2 of 3 pieces", theme::kAmber);
}

TEST_F(Window, WithoutARunFolderNothingIsSaidToBeSaved) {
  options_.keeps_run = false;
  window_ = std::make_unique<LiveWindow>(session_, options_);
  scan(2);
  press(GLFW_KEY_Q);
  expect_text(picture("stop_without_folder"), "nothing is kept", theme::kGray);
  press(GLFW_KEY_ENTER);
  EXPECT_THAT(session_.calls, ElementsAre("stop"));
  session_.say(LivePhase::finished, "");
  expect_text(picture("finished_without_folder"), "Nothing is kept", theme::kText);
  EXPECT_EQ(find("Saved in"), nullptr);
}

TEST_F(Window, PicturesGoToTheRunFolder) {
  scan(6);
  press(GLFW_KEY_P);
  const auto shot = options_.picture_folder / "screenshot_001.png";
  EXPECT_EQ(cv::imread(shot.string()).size(), cv::Size(820, 540));
  EXPECT_THAT(window_->controls().toasts().back().text, HasSubstr(shot.string()));
}

}  // namespace
}  // namespace gelslam::test
