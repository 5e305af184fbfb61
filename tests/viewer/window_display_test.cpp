// The live window on a real display (ctest runs this under Xvfb): what GLFW itself reports reaches the
// session.

#include <GLFW/glfw3.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "fake_session.hpp"
#include "gelslam/viewer/map_window.hpp"
#include "live/live_window.hpp"
#include "temporary_folder.hpp"

namespace gelslam::test {
namespace {

using namespace viewer;
using namespace viewer::detail;
using testing::ElementsAre;

WindowOptions small_window(const TemporaryFolder& folder) {
  WindowOptions options;
  options.width_px = 640;
  options.height_px = 420;
  options.picture_folder = folder.path();
  return options;
}

TEST(WindowOnADisplay, TakesWhatGlfwReports) {
  if (std::getenv("DISPLAY") == nullptr) GTEST_SKIP() << "no display; run under xvfb-run";
  const TemporaryFolder folder;
  FakeSession session(2);
  session.advance(4);
  LiveWindow window(session, small_window(folder));
  GLFWwindow* glfw = window.host().glfw_window();
  ASSERT_NE(glfw, nullptr);
  const auto key_callback = glfwSetKeyCallback(glfw, nullptr);
  const auto close_callback = glfwSetWindowCloseCallback(glfw, nullptr);
  key_callback(glfw, GLFW_KEY_SPACE, 0, GLFW_PRESS, 0);
  key_callback(glfw, GLFW_KEY_SPACE, 0, GLFW_REPEAT, 0);  // held down: not again
  key_callback(glfw, GLFW_KEY_SPACE, 0, GLFW_RELEASE, 0);
  window.turn(0.1);
  EXPECT_THAT(session.calls, ElementsAre("pause"));
  close_callback(glfw);
  window.turn(0.2);
  ASSERT_TRUE(window.controls().question());
  EXPECT_EQ(window.controls().question()->title, "Stop the scan?");
  EXPECT_FALSE(glfwWindowShouldClose(glfw));
  const cv::Mat3b shown = window.picture(0.3);
  EXPECT_EQ(shown.size(), cv::Size(640, 420));
  cv::Scalar mean, deviation;
  cv::meanStdDev(shown, mean, deviation);
  EXPECT_GT(deviation[1], 5) << "not blank";
}

/// As N does: what was pressed meanwhile reaches the second scan.
TEST(WindowOnADisplay, TheNextScanBeginsInTheSameWindow) {
  if (std::getenv("DISPLAY") == nullptr) GTEST_SKIP() << "no display; run under xvfb-run";
  const TemporaryFolder folder;
  WindowOptions options = small_window(folder);
  options.host = std::make_shared<WindowHost>(options);
  const std::weak_ptr<WindowHost> host = options.host;
  GLFWwindow* const glfw = options.host->glfw_window();
  {
    FakeSession first(2);
    first.advance(4);
    LiveWindow(first, options).turn(0.1);
  }
  options.host->push({InputEvent::Kind::key, GLFW_KEY_SPACE, true});
  FakeSession second(2);
  {
    LiveWindow window(second, options);
    EXPECT_EQ(window.host().glfw_window(), glfw);
    EXPECT_EQ(window.picture(0.1).size(), cv::Size(640, 420));
  }
  EXPECT_THAT(second.calls, ElementsAre("pause"));
  options.host.reset();
  EXPECT_TRUE(host.expired()) << "it closes after the last scan";
}

TEST(WindowOnADisplay, AMapIsShownUntilSomebodyEndsIt) {
  if (std::getenv("DISPLAY") == nullptr) GTEST_SKIP() << "no display; run under xvfb-run";
  const TemporaryFolder folder;
  LocatedTouches touches;
  std::jthread locating([&](const std::stop_token& token) {  // goes on while the window draws
    for (std::int64_t frame = 0; !token.stop_requested(); ++frame) {
      auto touch = std::make_shared<FrameReport>();
      touch->tracked.status = frame < 3 ? TrackStatus::background : TrackStatus::no_contact;
      touches.newest = touch;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  });
  WindowOptions options = small_window(folder);
  options.snapshot = folder / "end.png";
  options.asks_to_end = [asked = 0]() mutable { return ++asked > 20; };
  run_map_window({}, touches, options);
  EXPECT_EQ(cv::imread((folder / "end.png").string()).size(), cv::Size(640, 420));
}

}  // namespace
}  // namespace gelslam::test
