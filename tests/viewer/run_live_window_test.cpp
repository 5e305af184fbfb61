// The functions that commands call, from opening to closing.

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "fake_session.hpp"
#include "gelslam/viewer/window.hpp"
#include "temporary_folder.hpp"
#include "window_pictures.hpp"

namespace gelslam::test {
namespace {

namespace theme = viewer::theme;
TEST(LiveSnapshot, IsDrawnWithoutADisplay) {
  if (!can_draw()) GTEST_SKIP() << "no OpenGL here, not even without a display";
  const TemporaryFolder folder;
  FakeSession session(6, 1);
  session.advance(6);
  WindowOptions options;
  options.width_px = 800;
  options.height_px = 500;
  write_live_snapshot(session, folder / "new" / "snapshot.png", options);
  const cv::Mat3b shown = cv::imread((folder / "new" / "snapshot.png").string());
  ASSERT_EQ(shown.size(), cv::Size(800, 500));
  EXPECT_GT(share_of(shown, {0, 0, 300, 80}, theme::kGreen), 0.02) << "it says Tracking";
  EXPECT_GT(glowing(shown, {0, 0, 550, 440}), 1000);
}

TEST(RunLiveWindow, FramesComeAfterItsFirstPictureAndItsLastIsKept) {
  if (!can_draw()) GTEST_SKIP() << "no OpenGL here, not even without a display";
  const TemporaryFolder folder;
  FakeSession session(4, 1);
  session.looks_until_finished = 10;
  WindowOptions options;
  options.visible = false;
  options.width_px = 900;
  options.height_px = 600;
  options.snapshot = folder / "last.png";
  options.asks_to_end = [] { return true; };
  bool shown = false;
  options.when_shown = [&] {
    shown = true;
    session.advance(4);
    session.stop();  // as the signal's watcher does
  };
  EXPECT_FALSE(run_live_window(session, options)) << "no other scan is wanted";
  EXPECT_TRUE(shown);
  const cv::Mat3b last = cv::imread((folder / "last.png").string());
  ASSERT_EQ(last.size(), cv::Size(900, 600));
  EXPECT_GT(share_of(last, {0, 0, 300, 80}, theme::kGreen), 0.02) << "it says Finished";
}

}  // namespace
}  // namespace gelslam::test
