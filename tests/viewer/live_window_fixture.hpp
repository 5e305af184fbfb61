#pragma once

#include <GLFW/glfw3.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "fake_session.hpp"
#include "live/live_window.hpp"
#include "temporary_folder.hpp"
#include "window_pictures.hpp"

namespace gelslam::test {

using namespace viewer;
using namespace viewer::detail;

/// The live window on a session that does what a test says, drawn into pictures without a display.
class Window : public testing::Test {
 protected:
  void SetUp() override {
    if (!can_draw()) GTEST_SKIP() << "no OpenGL here, not even without a display";
    options_.visible = false;
    options_.width_px = 820;
    options_.height_px = 540;
    options_.picture_folder = folder_ / "run";
    window_ = std::make_unique<LiveWindow>(session_, options_);
  }

  void scan(int frames) {
    session_.advance(frames);
    window_->turn(now_s_ += 0.04, true);
  }
  void press(int key) {
    window_->host().push({InputEvent::Kind::key, key, true});
    window_->turn(now_s_ += 0.02);
  }
  void show_all() {
    press(GLFW_KEY_R);
    window_->show_all_at_once();
  }
  /// The window as it is now, a frame after everything has arrived.
  cv::Mat3b picture(const std::string& name) {
    window_->turn(now_s_ += 0.6, true);
    return kept(window_->picture(now_s_ += 0.02), name);
  }
  /// The first that is drawn, or the last: a dialog's words may stand on a button below it, too.
  const DrawnText* find(const std::string& text, bool topmost = false) const {
    const DrawnText* found = nullptr;
    for (const DrawnText& drawn : window_->texts())
      if (drawn.text.find(text) != std::string::npos && (topmost || found == nullptr)) found = &drawn;
    return found;
  }
  /// The words are there, within the picture, as letters of that color on something else.
  void expect_text(const cv::Mat3b& picture, const std::string& text, Color color, bool topmost = false) {
    const DrawnText* drawn = find(text, topmost);
    ASSERT_NE(drawn, nullptr) << text;
    EXPECT_EQ(drawn->color, color) << text;
    EXPECT_GE(drawn->box.x, 0) << text;
    EXPECT_LE(drawn->box.right(), picture.cols) << text;
    EXPECT_LE(drawn->box.bottom(), picture.rows) << text;
    const double ink = ink_in(picture, drawn->box, color);
    EXPECT_GT(ink, 0.06) << text;
    EXPECT_LT(ink, 0.6) << text;
  }
  const Box& view() const { return window_->view(); }

  const TemporaryFolder folder_;
  WindowOptions options_;
  FakeSession session_;
  std::unique_ptr<LiveWindow> window_;
  double now_s_ = 0;
};

}  // namespace gelslam::test
