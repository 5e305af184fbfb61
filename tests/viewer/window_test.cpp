// The live window while a scan goes on and at its end, and the files that a scan leaves.

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "live_window_fixture.hpp"

namespace gelslam::test {
namespace {

TEST_F(Window, SaysInWordsAndColorHowItGoes) {
  expect_text(picture("background"), "Getting ready", theme::kBlue);
  scan(1);
  expect_text(picture("first_touch"), "Tracking", theme::kGreen);
  session_.say(LivePhase::scanning, "tracking", TrackStatus::tracked, "sliding along x is not observable");
  expect_text(picture("uncertain"), "Position uncertain", theme::kAmber);
  session_.say(LivePhase::scanning, "lost", TrackStatus::lost);
  session_.figures().warnings = {"The log has stopped: the disk is full. The scan goes on."};
  session_.figures().dropped = 12;
  cv::Mat3b shown = picture("lost");
  expect_text(shown, "Lost", theme::kRed);
  expect_text(shown, "Touch a place you have seen.", theme::kText);
  expect_text(shown, "the disk is full", theme::kText);
  expect_text(shown, "12", theme::kAmber);
  session_.figures().warnings.clear();
  session_.release();
  expect_text(picture("no_contact"), "No contact", theme::kAmber);
  press(GLFW_KEY_SPACE);
  shown = picture("paused");
  expect_text(shown, "Paused", theme::kGray);
  expect_text(shown, "Go on", theme::kText);
  EXPECT_EQ(find("Lost"), nullptr);
}

TEST_F(Window, ShowsTheSurfaceGrowingAndTheTouchOnIt) {
  const cv::Mat3b empty = picture("empty");
  scan(4);
  show_all();
  session_.release();
  const double first = change(empty, picture("two_places"), view());
  scan(18);
  press(GLFW_KEY_F);  // follow again
  for (int i = 0; i < 15; ++i) window_->turn(now_s_ += 0.1);
  EXPECT_GT(glowing(picture("tracking"), view()), 3000) << "the touch glows, in front";
  session_.release();
  show_all();
  const cv::Mat3b untouched = picture("untouched");
  EXPECT_LT(glowing(untouched, view()), 100);
  EXPECT_GT(first, 0.05);
  EXPECT_GT(change(empty, untouched, view()), 0.15);
  EXPECT_LT(change(empty, untouched, view()), 0.7);
  // All of it is in view: nothing but background along the borders.
  for (const Box& border : {Box{0, 120, 8, view().height - 120}, Box{view().width - 8, 0, 8, view().height}})
    EXPECT_LT(change(empty(cv::Rect(cvRound(border.x), cvRound(border.y), 8, cvRound(border.height))),
                     untouched(cv::Rect(cvRound(border.x), cvRound(border.y), 8, cvRound(border.height))),
                     {0, 0, 8, border.height}),
              0.01);
}

TEST_F(Window, TheTouchStaysWhereItIsWhileTheMapperIsBusy) {
  const auto settled = [&](const char* name) {
    for (int i = 0; i < 40; ++i) window_->turn(now_s_ += 0.1);
    return picture(name);
  };
  scan(4);
  session_.mapper_is_busy = true;
  scan(4);  // at another place
  const cv::Mat3b busy = settled("busy");
  EXPECT_GT(glowing(busy, view()), 3000);
  session_.mapper_is_busy = false;
  scan(1);
  const cv::Mat3b known = settled("known");
  EXPECT_NEAR(glowing(busy, view()), glowing(known, view()), 0.1 * glowing(known, view()));
  EXPECT_LT(change(busy, known, view()), 0.1) << "but for the surface that came";
}

TEST_F(Window, ShowsPicturesFiguresAndOnRequestDiagnostics) {
  scan(3);
  const cv::Mat3b usual = picture("usual_figures");
  for (const char* label : {"Rate", "Latency", "Dropped", "Components"})
    expect_text(usual, label, theme::kDim);
  for (const char* label : {"Memory", "Camera lost"}) EXPECT_EQ(find(label), nullptr) << label;
  press(GLFW_KEY_I);
  const cv::Mat3b shown = picture("figures");
  for (const char* text : {"25.0 Hz", "18 ms", "412 MB", "1.86 MB"}) expect_text(shown, text, theme::kText);
  for (const char* label :
       {"Rate", "Latency", "Keyframes", "Loops", "Trials", "Components", "Camera lost", "Dropped", "Damaged",
        "Memory", "Log", "Disk free", "Touch and contact", "Normals"})
    expect_text(shown, label, theme::kDim);
  const DrawnText *touch = find("Touch and contact"), *normals = find("Normals");
  ASSERT_TRUE(touch && normals);
  const Box between{touch->box.x, touch->box.bottom() + 6, 150, normals->box.y - touch->box.bottom() - 20};
  EXPECT_GT(share_of(shown, between, theme::rgb(112, 120, 118)), 0.3) << "the untouched gel";
  EXPECT_GT(share_of(shown, between, theme::kGreen), 0.005) << "the contact's outline";
}

TEST_F(Window, TheCardsLeaveTheObjectFree) {
  session_.figures().warnings = {"The log has stopped: the disk is full.", "The picture is very dark."};
  scan(6);
  for (int i = 0; i < 40; ++i) window_->turn(now_s_ += 0.1);
  const cv::Mat3b shown = picture("follow_below_cards");
  const DrawnText* last = find("The picture is very dark.");
  ASSERT_NE(last, nullptr);
  const auto bottom = static_cast<int>(last->box.bottom());
  // The touch, which the view follows, lies in the middle of what is free.
  cv::Moments glow;
  cv::Mat1b mask(shown.size(), uchar{0});
  for (int y = bottom; y < static_cast<int>(view().bottom()); ++y)
    for (int x = 0; x < static_cast<int>(view().width); ++x)
      mask(y, x) = shown(y, x)[2] > shown(y, x)[0] + 90 ? 1 : 0;
  glow = cv::moments(mask, true);
  EXPECT_GT(glow.m00, 3000);
  EXPECT_NEAR(glow.m01 / glow.m00, 0.5 * (bottom + static_cast<double>(view().bottom())), 40);
}

/// Pixels of the color in which a piece is drawn that is not joined to the map.
int bluish(const cv::Mat3b& picture, const Box& view) {
  int count = 0;
  for (const cv::Vec3b& p : within(picture, {0, 130, view.width, view.height - 130}))
    count += p[0] > 130 && p[0] > p[2] + 60;
  return count;
}

TEST_F(Window, WhatIsNotJoinedGrowsBesideTheMap) {
  scan(7);
  const cv::Mat3b joined = picture("on_the_map");
  EXPECT_GT(glowing(joined, view()), 3000);
  EXPECT_LT(bluish(joined, view()), 100);
  session_.leave_the_map();
  session_.say(LivePhase::scanning, "lost", TrackStatus::lost);
  for (int i = 0; i < 30; ++i) window_->turn(now_s_ += 0.1);  // the camera turns to both
  const cv::Mat3b apart = picture("apart");
  expect_text(apart, "What you touch grows beside the map", theme::kText);
  EXPECT_GT(bluish(apart, view()) + glowing(apart, view()), 2000) << "the piece with the touch on it";
  session_.join_the_map();
  session_.say(LivePhase::scanning, "tracking");
  window_->turn(now_s_ += 0.05, true);
  EXPECT_LT(bluish(picture("joined"), view()), 100);
}

TEST_F(Window, HelpNamesEveryKeyAndFits) {
  for (const auto& [width, height] : {std::pair{820, 540}, {640, 480}}) {
    window_->host().resize(width, height);
    window_->turn(now_s_ += 0.02, true);
    press(GLFW_KEY_H);
    const cv::Mat3b shown = picture("help_" + std::to_string(width));
    for (const ActionRow& row : window_->controls().rows())
      if (!row.help.empty()) expect_text(shown, row.help, theme::kText, /*topmost=*/true);
    expect_text(shown, "Double click", theme::kBlue);
    press(GLFW_KEY_ESCAPE);
  }
}

TEST_F(Window, ButtonsAndDialogsWorkByMouse) {
  options_.next_run_folder = "RUN-2";
  window_ = std::make_unique<LiveWindow>(session_, options_);
  scan(2);
  const auto click = [this](const std::string& text) {
    picture("before_click");
    const DrawnText* drawn = find(text);
    ASSERT_NE(drawn, nullptr) << text;
    const double x = drawn->box.x + 0.5 * drawn->box.width, y = drawn->box.y + 0.5 * drawn->box.height;
    window_->host().push({InputEvent::Kind::pointer, 0, false, x, y});
    window_->turn(now_s_ += 0.02, true);
    // Both at once, as a fast finger does within one frame.
    window_->host().push({InputEvent::Kind::button, GLFW_MOUSE_BUTTON_LEFT, true});
    window_->host().push({InputEvent::Kind::button, GLFW_MOUSE_BUTTON_LEFT, false});
    for (int i = 0; i < 3; ++i) window_->turn(now_s_ += 0.02, true);
  };
  click("Pause");
  click("Go on");
  click("New scan");
  expect_text(picture("new_scan"), "Start a new scan?", theme::kText);
  EXPECT_NE(find("RUN-2"), nullptr);
  click("Go on scanning");
  click("Stop");
  click("Pause");  // lies under the dialog
  click("Stop and save");
  EXPECT_THAT(session_.calls, ElementsAre("pause", "go on", "stop"));
  expect_text(picture("finishing"), "Finishing", theme::kBlue);
}

TEST_F(Window, EverySizeIsDrawnWhole) {
  scan(6);
  for (const auto& [width, height] : {std::pair{400, 300}, {120, 100}, {1920, 1080}, {300, 900}}) {
    window_->host().resize(width, height);
    show_all();
    const cv::Mat3b shown = picture("size_" + std::to_string(width));
    EXPECT_EQ(shown.size(), cv::Size(width, height));
    cv::Scalar mean, deviation;
    cv::meanStdDev(shown, mean, deviation);
    EXPECT_GT(deviation[0], 3) << width;
    if (width >= 300) expect_text(shown, "Tracking", theme::kGreen);
    EXPECT_EQ(window_->has_side(), width >= 820) << width;
  }
}

TEST_F(Window, DrawsOnlyWhenThereIsSomethingNew) {
  scan(2);
  press(GLFW_KEY_F);  // or the camera is still on its way
  for (int i = 0; i < 3; ++i) window_->turn(now_s_ += 0.3);
  EXPECT_FALSE(window_->turn(now_s_ += 0.02));
  EXPECT_FALSE(window_->turn(now_s_ += 0.02));
  session_.advance();
  EXPECT_TRUE(window_->turn(now_s_ += 0.02));
}

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
  expect_text(picture("end_with_components"), "2 of 3 components", theme::kAmber);
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
