// The functions that commands call, from opening to closing.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "fake_session.hpp"
#include "gelslam/viewer/window.hpp"
#include "temporary_folder.hpp"
#include "window_pictures.hpp"

namespace gelslam::test {
namespace {

namespace theme = viewer::theme;
using testing::ElementsAre;
using testing::HasSubstr;

WindowOptions hidden(int width_px, int height_px) {
  WindowOptions options;
  options.visible = false;
  options.width_px = width_px;
  options.height_px = height_px;
  return options;
}

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

TEST(RunLiveWindow, FramesComeAfterItsFirstPicture) {
  if (!can_draw()) GTEST_SKIP() << "no OpenGL here, not even without a display";
  const TemporaryFolder folder;
  FakeSession session(4, 1);
  WindowOptions options = hidden(900, 600);
  options.picture_folder = folder.path();
  options.script = "screenshot start.png\nuntil tracking\nscreenshot tracking.png\nquit";
  options.when_shown = [&] { session.advance(4); };
  run_live_window(session, options);
  const viewer::Box state{0, 0, 300, 80};
  const cv::Mat3b start = cv::imread((folder / "start.png").string()),
                  tracking = cv::imread((folder / "tracking.png").string());
  EXPECT_GT(share_of(start, state, theme::kBlue), 0.02) << "it says Getting ready";
  EXPECT_GT(share_of(tracking, state, theme::kGreen), 0.02) << "it says Tracking";
}

TEST(RunLiveWindow, PlaysAScriptAsAPersonWould) {
  if (!can_draw()) GTEST_SKIP() << "no OpenGL here, not even without a display";
  const TemporaryFolder folder;
  FakeSession session(4, 1);
  session.advance(4);
  session.looks_until_finished = 20;
  WindowOptions options = hidden(600, 400);
  options.picture_folder = folder.path();
  options.snapshot = folder / "last.png";
  options.script =
      "until tracking\nkey space; until paused\nkey space\ndrag 60 10\nscroll 2\nscreenshot a.png\n"
      "resize 500 350\nkey q\nclick Stop and save\nuntil finished 20\nkey q";
  run_live_window(session, options);
  EXPECT_THAT(session.calls, ElementsAre("pause", "go on", "stop"));
  EXPECT_EQ(cv::imread((folder / "a.png").string()).size(), cv::Size(600, 400));
  EXPECT_EQ(cv::imread((folder / "last.png").string()).size(), cv::Size(500, 350));
}

TEST(RunLiveWindow, EndedFromTheTerminalItClosesOnceAllIsSaved) {
  if (!can_draw()) GTEST_SKIP() << "no OpenGL here, not even without a display";
  FakeSession session(2, 1);
  session.advance(2);
  session.looks_until_finished = 10;
  WindowOptions options = hidden(600, 400);
  int asked = 0;
  options.asks_to_end = [&] { return ++asked > 0; };
  session.stop();  // as the signal's watcher does
  run_live_window(session, options);
  EXPECT_EQ(session.status().phase, LivePhase::finished) << "not before";
  EXPECT_GT(asked, 0);
}

TEST(RunLiveWindow, ANewScanBeginsOnceThisOneIsSavedAndTheScriptGoesOnThere) {
  if (!can_draw()) GTEST_SKIP() << "no OpenGL here, not even without a display";
  WindowOptions options = hidden(600, 400);
  options.next_run_folder = "RUN-2";
  options.script = "until tracking\nkey n # another\nkey enter; until tracking 5; key space; quit";
  FakeSession session(2, 1);
  session.advance(2);
  session.looks_until_finished = 10;
  const WindowEnd end = run_live_window(session, options);
  EXPECT_EQ(end.next, NextStep::new_scan);
  EXPECT_EQ(session.status().phase, LivePhase::finished) << "not before";
  FakeSession another(2, 1);
  another.advance(2);
  options.script = end.script;
  EXPECT_EQ(run_live_window(another, options).next, NextStep::none);
  EXPECT_THAT(another.calls, ElementsAre("pause"));
  options.script = end.script + "; jump";
  options.script_name = "demo.txt";
  EXPECT_THAT(message_of<Error>([&] { run_live_window(another, options); }), HasSubstr("demo.txt, line 3:"));
}

TEST(RunLiveWindow, AScriptThatWaitsInVainSaysWhere) {
  if (!can_draw()) GTEST_SKIP() << "no OpenGL here, not even without a display";
  FakeSession session(1);
  WindowOptions options = hidden(200, 200);
  options.script_name = "demo.txt";
  options.script = "wait 0\nuntil tracking 0.1";
  EXPECT_EQ(message_of<Error>([&] { run_live_window(session, options); }),
            "demo.txt, line 2: waited in vain for 'tracking'; it is 'background'");
  options.script = "wait 0; scrol 2";
  EXPECT_THAT(message_of<Error>([&] { run_live_window(session, options); }), HasSubstr("did you mean"));
}

}  // namespace
}  // namespace gelslam::test
